// SPDX-License-Identifier: Apache-2.0
#include "compare/figure_text.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "marrow/base/number_text.hpp"

namespace marrow::cli {
namespace {

constexpr double kLargestFixed = 1e7, kSmallestFixed = 1e-5;

int power_of_ten(double value) { return int(std::floor(std::log10(value))); }

}  // namespace

NumberScale::NumberScale(const std::vector<double>& values) {
  double largest = 0, smallest = std::numeric_limits<double>::infinity();
  for (const double value : values) {
    const double size = std::abs(value);
    if (!std::isfinite(size) || size == 0) continue;
    largest = std::max(largest, size);
    smallest = std::min(smallest, size);
  }
  if (largest == 0) return;
  has_exponents_ = largest >= kLargestFixed || largest < kSmallestFixed;
  if (has_exponents_) return;
  const int of_largest = power_of_ten(largest), of_smallest = power_of_ten(smallest);
  const int wanted = of_largest < 0 ? 3 - of_largest : of_largest < 2 ? 4 : std::max(0, 5 - of_largest);
  decimals_ = std::clamp(2 - of_smallest, wanted, wanted + 3);  // three digits of the smallest, if that is not too many
}

std::string NumberScale::text(double value) const {
  if (value == 0) return fixed_number(0, has_exponents_ ? 0 : decimals_);
  const bool is_too_small = std::abs(value) < 10 * std::pow(10.0, -decimals_);
  return has_exponents_ || is_too_small ? formatted("{:.3e}", value) : formatted("{:.{}f}", value, decimals_);
}

std::string rate_text(std::size_t count, std::size_t of, const compare::Interval& interval, int decimals) {
  if (!of) return "-";
  return formatted("{}/{} ({} to {} %)", count, of, percent_text(interval.lower, decimals),
                   percent_text(interval.upper, decimals));
}

}  // namespace marrow::cli
