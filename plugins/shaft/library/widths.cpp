// SPDX-License-Identifier: Apache-2.0
#include "marrow/shaft/widths.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <marrow/base/error.hpp>
#include <marrow/domain/transform.hpp>

#include "marrow/base/number_text.hpp"

namespace marrow::shaft {
namespace {

constexpr double kMost = 3;                                   // standard deviations
constexpr double kTaperDeviation_deg = 3, kAnyTaper_deg = 6;  // for a known taper and for an unknown one

/// Outer diameters of 24 femora: mean and standard deviation from side to side, then from front to back (with the linea
/// aspera). Levels from 20 % to 75 % of the length above the condyles, in steps of 5 % of 446 mm. At mid-shaft they
/// agree with those of 170 and of several hundred femora that were measured elsewhere.
constexpr double kStep_mm = 0.05 * 446;
constexpr std::array<std::array<double, 4>, 12> kFemur{{{36.7, 4.0, 32.4, 3.4},
                                                        {33.2, 3.5, 31.3, 3.3},
                                                        {30.7, 3.0, 30.5, 3.1},
                                                        {29.1, 2.8, 30.1, 3.1},
                                                        {28.3, 2.9, 30.5, 3.3},
                                                        {28.0, 3.1, 30.2, 3.0},
                                                        {28.0, 3.3, 30.3, 3.0},
                                                        {28.2, 3.4, 29.8, 2.8},
                                                        {28.6, 3.4, 30.1, 2.6},
                                                        {29.1, 3.4, 30.6, 2.9},
                                                        {29.9, 3.5, 31.0, 3.2},
                                                        {31.4, 3.7, 31.3, 3.1}}};

std::vector<Width> femur() {
  std::vector<Width> widths;
  for (std::size_t i = 0; i < kFemur.size(); ++i)
    for (const std::size_t side : {0, 2}) {
      const std::size_t below = i > 0 ? i - 1 : 0, above = std::min(i + 1, kFemur.size() - 1);
      const double change_mm = kFemur[above][side] - kFemur[below][side];
      const double taper = std::atan(std::abs(change_mm) / (double(above - below) * kStep_mm));
      widths.push_back({kFemur[i][side], kFemur[i][side + 1], degrees(taper)});
    }
  return widths;
}

}  // namespace

Widths::Widths(const std::vector<double>& mean_mm, const std::vector<double>& deviation_mm,
               double magnification_tolerance)
    : magnification_tolerance_(magnification_tolerance) {
  if (mean_mm.empty()) widths_ = femur();
  for (std::size_t i = 0; i < mean_mm.size(); ++i) {
    if (!(mean_mm[i] > 0) || !(deviation_mm.at(i) > 0)) throw Error("width_mm and width_deviation_mm must be positive");
    widths_.push_back({mean_mm[i], deviation_mm[i], -1});
  }
}

double Widths::deviation_mm(const Width& width) const {
  return std::hypot(width.deviation_mm, magnification_tolerance_ * width.mean_mm);
}

double Widths::log_likelihood(double width_mm, double taper_deg) const {
  double best = -std::numeric_limits<double>::infinity();
  for (const Width& width : widths_) {
    const double by_width = (width_mm - width.mean_mm) / deviation_mm(width);
    const double by_taper =
        width.taper_deg < 0 ? taper_deg / kAnyTaper_deg : (taper_deg - width.taper_deg) / kTaperDeviation_deg;
    best = std::max(best, -0.5 * (by_width * by_width + by_taper * by_taper));
  }
  return best;
}

bool Widths::is_possible(double width_mm) const {
  return std::any_of(widths_.begin(), widths_.end(), [&](const Width& width) {
    return std::abs(width_mm - width.mean_mm) <= kMost * deviation_mm(width);
  });
}

double Widths::least_mm() const {
  double least = std::numeric_limits<double>::infinity();
  for (const Width& width : widths_) least = std::min(least, width.mean_mm - kMost * deviation_mm(width));
  return least;
}

std::string Widths::range() const {
  double most = 0;
  for (const Width& width : widths_) most = std::max(most, width.mean_mm + kMost * deviation_mm(width));
  return formatted("{:.1f} to {:.1f} mm", least_mm(), most);
}

}  // namespace marrow::shaft
