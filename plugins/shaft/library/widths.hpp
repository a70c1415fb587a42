// SPDX-License-Identifier: Apache-2.0
#pragma once
// Widths and tapers of shafts, by which a pair of borders is judged.
#include <string>
#include <vector>

namespace marrow::shaft {

/// The outer diameter of a shaft at one level, seen from one side, over many people.
struct Width {
  double mean_mm = 0, deviation_mm = 0;
  double taper_deg = 0;  ///< angle between the borders at this level; negative: not known
};

class Widths {
 public:
  /// Widths of femora by level if `mean_mm` is empty. Otherwise of another bone: a mean and a standard deviation for
  /// each direction from which it may be seen (lists of equal length). `magnification_tolerance`: relative standard
  /// deviation of the magnification at the shaft's depth. Throws Error unless all means and deviations are positive.
  Widths(const std::vector<double>& mean_mm, const std::vector<double>& deviation_mm, double magnification_tolerance);

  /// Log-likelihood of a pair of borders for the level and direction that fit it best. 0 for the most likely pair, else
  /// negative.
  double log_likelihood(double width_mm, double taper_deg) const;
  /// Whether the width is within three standard deviations of the mean at some level.
  bool is_possible(double width_mm) const;
  /// The smallest possible width.
  double least_mm() const;
  /// The range of possible widths: "18.6 to 48.7 mm".
  std::string range() const;

 private:
  double deviation_mm(const Width& width) const;  ///< includes that of the magnification

  std::vector<Width> widths_;
  double magnification_tolerance_;
};

}  // namespace marrow::shaft
