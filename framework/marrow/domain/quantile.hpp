// SPDX-License-Identifier: Apache-2.0
#pragma once
// The one definition of quantiles in marrow, medians among them (fraction 0.5): numpy's default, "linear", which is
// type 7 of Hyndman and Fan (Sample quantiles in statistical packages, The American Statistician 50(4), 1996).
#include <algorithm>
#include <cmath>
#include <cstddef>
#include <vector>

#include "marrow/base/export.hpp"

namespace MARROW_EXPORT marrow {

/// The place of a quantile in ascending values: `part` of the way from the value at `below` to the value at `above`.
struct QuantilePlace {
  std::size_t below = 0, above = 0;
  double part = 0;
};

/// `count` is at least 1, `fraction` between 0 and 1.
inline QuantilePlace quantile_place(std::size_t count, double fraction) {
  const double position = fraction * double(count - 1);
  const std::size_t below = std::min(std::size_t(position), count - 1);
  const double part = position - double(below);
  return {below, part > 0 ? below + 1 : below, part};
}

/// The quantile of values in ascending order. There must be at least one value, and none may be NaN.
template <class Number>
double quantile_of_sorted(const std::vector<Number>& sorted, double fraction) {
  const QuantilePlace place = quantile_place(sorted.size(), fraction);
  return std::lerp(double(sorted[place.below]), double(sorted[place.above]), place.part);
}

/// The same for values in any order, in linear time. Changes their order.
template <class Number>
double quantile_in_place(std::vector<Number>& values, double fraction) {
  const QuantilePlace place = quantile_place(values.size(), fraction);
  const auto below = values.begin() + std::ptrdiff_t(place.below);
  std::nth_element(values.begin(), below, values.end());
  if (place.above == place.below) return double(*below);
  return std::lerp(double(*below), double(*std::min_element(below + 1, values.end())), place.part);
}

/// The same, but the caller's values keep their order.
template <class Number>
double quantile(std::vector<Number> values, double fraction) {
  return quantile_in_place(values, fraction);
}

}  // namespace marrow
