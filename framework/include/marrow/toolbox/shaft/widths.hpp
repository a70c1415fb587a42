// SPDX-License-Identifier: Apache-2.0
#pragma once
// How wide shafts are, and how they taper: what a pair of borders is judged by.
#include <string>
#include <vector>

namespace marrow::shaft {

/// The outer diameter of a shaft at one level, seen from one side, over many people.
struct Width {
  double mean_mm = 0, deviation_mm = 0;
  double taper_deg = 0;  ///< angle between its borders there; negative: not known
};

class Widths {
 public:
  /// Of femora, by level; or, where `mean_mm` is not empty, of another bone: a mean and a deviation for each direction
  /// from which it may be seen. The magnification at the shaft's depth is known to a deviation of so many parts of one.
  /// Throws Error unless all are positive.
  Widths(const std::vector<double>& mean_mm, const std::vector<double>& deviation_mm, double magnification_tolerance);

  /// Log-likelihood of a pair of borders, relative to the likeliest one, for the level and direction that fit it best.
  double log_likelihood(double width_mm, double taper_deg) const;
  /// Whether the width is within three deviations at some level.
  bool is_possible(double width_mm) const;
  double least_mm() const;
  /// "18.6 to 48.7 mm"
  std::string range() const;

 private:
  double deviation_mm(const Width& width) const;  ///< with that of the magnification

  std::vector<Width> widths_;
  double magnification_tolerance_;
};

}  // namespace marrow::shaft
