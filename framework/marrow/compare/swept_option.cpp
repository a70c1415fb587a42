// SPDX-License-Identifier: Apache-2.0
#include "marrow/compare/swept_option.hpp"

#include <algorithm>
#include <cmath>

namespace marrow::compare {

double SweptOption::value_at(double fraction) const {
  const auto& [low, high] = range;
  const double value = is_log ? low * std::pow(high / low, fraction) : low + (high - low) * fraction;
  return is_whole ? std::round(value) : value;
}

double SweptOption::fraction_of(double value) const {
  const auto& [low, high] = range;
  if (is_log && !(value > 0)) return 0;
  const double fraction = is_log ? std::log(value / low) / std::log(high / low) : (value - low) / (high - low);
  return std::clamp(fraction, 0.0, 1.0);
}

}  // namespace marrow::compare
