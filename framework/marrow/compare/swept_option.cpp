// SPDX-License-Identifier: Apache-2.0
#include "marrow/compare/swept_option.hpp"

#include <algorithm>
#include <cmath>

#include "marrow/base/number_text.hpp"

namespace marrow::compare {
namespace {

/// Rounded to a power of ten that is at most a thousandth of `range`.
double rounded(double value, double range) {
  const double step = std::pow(10, std::floor(std::log10(range / 1000)));
  return parsed_number(formatted("{:.15g}", std::round(value / step) * step)).value();
}

}  // namespace

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

std::vector<double> TuneRule::values_at(const std::vector<double>& fractions) const {
  std::vector<double> values;
  for (std::size_t o = 0; o < options.size(); ++o) {
    const SweptOption& option = options[o];
    const double value = option.value_at(std::clamp(fractions[o], 0.0, 1.0));
    const double near = option.is_log ? value : option.range[1] - option.range[0];
    values.push_back(std::clamp(rounded(value, near), option.range[0], option.range[1]));
  }
  return values;
}

}  // namespace marrow::compare
