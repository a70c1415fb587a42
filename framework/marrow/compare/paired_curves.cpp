// SPDX-License-Identifier: Apache-2.0
#include "marrow/compare/paired_curves.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "marrow/base/error.hpp"
#include "marrow/base/number_text.hpp"
#include "marrow/domain/quantile.hpp"

namespace marrow::compare {
namespace {

constexpr double kGap = std::numeric_limits<double>::quiet_NaN();
constexpr double kSameTime = 0.05, kEqual = 0.001;  // of a step: on one raster, and where one is interpolated
constexpr double kFarthest = 1.5;                   // steps between two neighbours
constexpr double kSameStep = 0.001;                 // relative

double step_of(const Curve& curve, const char* which) {
  if (curve.at.size() != curve.values.size())
    throw Error(formatted("the {} curve has {} times and {} values", which, curve.at.size(), curve.values.size()));
  if (curve.at.size() < 2)
    throw Error(formatted("the {} sequence has {}; a comparison over time needs at least two", which,
                          counted(curve.at.size(), "frame")));
  std::vector<double> steps;
  for (std::size_t i = 1; i < curve.at.size(); ++i) steps.push_back(curve.at[i] - curve.at[i - 1]);
  for (std::size_t i = 0; i < steps.size(); ++i)
    if (!(steps[i] > 0))
      throw Error(formatted("the times of the {} sequence do not rise: {} comes after {}", which,
                            short_number(curve.at[i + 1], 9), short_number(curve.at[i], 9)));
  return quantile_in_place(steps, 0.5);
}

void expect_overlap(const Curve& first, const Curve& second, double tolerance) {
  if (second.at.front() <= first.at.back() + tolerance && first.at.front() <= second.at.back() + tolerance) return;
  throw Error(formatted("the two sequences do not overlap: the first is from {} to {}, the second from {} to {}",
                        short_number(first.at.front(), 6), short_number(first.at.back(), 6),
                        short_number(second.at.front(), 6), short_number(second.at.back(), 6)));
}

/// Whether all times of both lie at whole steps from each other. A list of times that begins anywhere else, or whose
/// step is another one, leaves the raster somewhere.
bool on_one_raster(const Curve& first, const Curve& second, double step) {
  const auto is_on = [&](double at) {
    const double steps = (at - first.at.front()) / step;
    return std::abs(steps - std::round(steps)) <= kSameTime;
  };
  return std::all_of(first.at.begin(), first.at.end(), is_on) && std::all_of(second.at.begin(), second.at.end(), is_on);
}

/// The curve's value at a time.
double value_at(const Curve& curve, double at, double step, double tolerance, bool& interpolates) {
  const auto after = std::lower_bound(curve.at.begin(), curve.at.end(), at - tolerance * step);
  if (after == curve.at.end()) return kGap;
  const std::size_t i = std::size_t(after - curve.at.begin());
  if (curve.at[i] <= at + tolerance * step) return curve.values[i];
  if (i == 0 || curve.at[i] - curve.at[i - 1] > kFarthest * step) return kGap;
  const double before = curve.values[i - 1], part = (at - curve.at[i - 1]) / (curve.at[i] - curve.at[i - 1]);
  interpolates = true;
  return before + part * (curve.values[i] - before);  // std::lerp may hide a NaN
}

std::vector<double> times_of_either(const Curve& first, const Curve& second, double step) {
  std::vector<double> both;
  std::merge(first.at.begin(), first.at.end(), second.at.begin(), second.at.end(), std::back_inserter(both));
  std::vector<double> times;
  for (const double at : both)
    if (times.empty() || at - times.back() > 0.5 * step) times.push_back(at);
  return times;
}

}  // namespace

PairedCurves pair_curves(const Curve& first, const Curve& second) {
  const double step_first = step_of(first, "first"), step_second = step_of(second, "second");
  PairedCurves pair;
  pair.step = std::max(step_first, step_second);
  expect_overlap(first, second, kSameTime * std::min(step_first, step_second));
  const bool same_step = std::abs(step_first - step_second) <= kSameStep * pair.step;
  const bool first_is_slower = step_first > step_second || same_step;
  const bool same_raster = same_step && on_one_raster(first, second, step_first);
  const double tolerance = same_raster ? kSameTime : kEqual;
  if (same_raster)
    pair.at = times_of_either(first, second, pair.step);
  else
    pair.at = first_is_slower ? first.at : second.at;
  bool of_first = false, of_second = false;
  for (const double at : pair.at) {
    pair.first.push_back(value_at(first, at, step_first, tolerance, of_first));
    pair.second.push_back(value_at(second, at, step_second, tolerance, of_second));
    pair.difference.push_back(pair.second.back() - pair.first.back());
  }
  if (of_first || of_second)
    pair.interpolated = of_second ? PairedCurves::Interpolated::second : PairedCurves::Interpolated::first;
  return pair;
}

}  // namespace marrow::compare
