// SPDX-License-Identifier: Apache-2.0
#include "marrow/compare/curve_difference.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <numeric>

#include "marrow/base/error.hpp"
#include "marrow/base/number_text.hpp"
#include "marrow/domain/quantile.hpp"
#include "marrow/domain/random.hpp"

namespace marrow::compare {
namespace {

constexpr std::size_t kFewestFrames = 12;  // of an interval, and of a correlation at a lag
constexpr int kMostFreedom = 8, kLeastFreedom = 2;
constexpr std::size_t kMostLags = 2000;
constexpr double kSameCorrelation = 1e-9;

double mean_of(const std::vector<double>& values) {
  return std::accumulate(values.begin(), values.end(), 0.0) / double(values.size());
}

/// With a correction of its bias (Kendall 1954, Biometrika 41:403).
double lag_one_autocorrelation(const std::vector<double>& values, double mean) {
  double products = 0, squares = 0;
  for (std::size_t i = 0; i < values.size(); ++i) {
    squares += (values[i] - mean) * (values[i] - mean);
    if (i > 0) products += (values[i] - mean) * (values[i - 1] - mean);
  }
  const double n = double(values.size());
  return std::clamp((n * products / squares + 1) / (n - 4), 0.0, 0.999);
}

int freedom_of(const std::vector<double>& values, double mean) {
  const double n = double(values.size());
  const double by_memory = n * (1 - lag_one_autocorrelation(values, mean)) / (3 * std::numbers::pi);
  const int most = std::min(kMostFreedom, int(0.4 * std::pow(n, 2.0 / 3)));
  return std::clamp(int(by_memory), kLeastFreedom, most);
}

/// Mean square of the first cosine weights.
double long_run_variance(const std::vector<double>& values, double mean, int freedom) {
  const double n = double(values.size());
  double sum = 0;
  for (int k = 1; k <= freedom; ++k) {
    double weight = 0;
    for (std::size_t i = 0; i < values.size(); ++i)
      weight += (values[i] - mean) * std::cos(std::numbers::pi * k * (double(i) + 0.5) / n);
    sum += 2 / n * weight * weight;
  }
  return sum / freedom;
}

/// Pearson's correlation. Nothing if a list is constant.
std::optional<double> correlation_of(const std::vector<double>& a, const std::vector<double>& b) {
  const double mean_a = mean_of(a), mean_b = mean_of(b);
  double ab = 0, aa = 0, bb = 0, size_a = 0, size_b = 0;
  for (std::size_t i = 0; i < a.size(); ++i) {
    ab += (a[i] - mean_a) * (b[i] - mean_b);
    aa += (a[i] - mean_a) * (a[i] - mean_a);
    bb += (b[i] - mean_b) * (b[i] - mean_b);
    size_a = std::max(size_a, std::abs(a[i]));
    size_b = std::max(size_b, std::abs(b[i]));
  }
  const auto is_constant = [&](double squares, double size) {  // but for rounding
    return !(std::sqrt(squares / double(a.size())) > 1e-12 * size);
  };
  if (is_constant(aa, size_a) || is_constant(bb, size_b)) return std::nullopt;
  return std::clamp(ab / std::sqrt(aa * bb), -1.0, 1.0);
}

/// Both curves on a raster without missing times. Empty if the times are none.
struct Raster {
  std::vector<double> first, second;

  explicit Raster(const PairedCurves& pair) {
    const auto steps_to = [&](double at) { return (at - pair.at.front()) / pair.step; };
    const double last = std::round(steps_to(pair.at.back()));
    if (!(last < 10.0 * double(pair.at.size()))) return;
    first.assign(std::size_t(last) + 1, std::numeric_limits<double>::quiet_NaN());
    second = first;
    for (std::size_t i = 0; i < pair.at.size(); ++i) {
      const double steps = steps_to(pair.at[i]), place = std::round(steps);
      if (std::abs(steps - place) > 0.25) {
        first.clear();
        return;
      }
      first[std::size_t(place)] = pair.first[i];
      second[std::size_t(place)] = pair.second[i];
    }
  }
  /// The correlation of first[i] with second[i + lag]. Nothing if too few pairs are left.
  std::optional<double> correlation(long lag, std::size_t least) const {
    std::vector<double> a, b;
    for (long i = std::max(0l, -lag); i < long(first.size()) && i + lag < long(second.size()); ++i)
      if (std::isfinite(first[std::size_t(i)]) && std::isfinite(second[std::size_t(i + lag)])) {
        a.push_back(first[std::size_t(i)]);
        b.push_back(second[std::size_t(i + lag)]);
      }
    return a.size() < least ? std::nullopt : correlation_of(a, b);
  }
};

constexpr std::size_t kDraws = 4999;
constexpr double kOutside = 0.05;

struct Moments {
  double mean = 0, squares = 0;  ///< of the deviations from the mean
};

Moments moments_at(const std::vector<std::vector<double>>& trials, std::size_t time) {
  Moments result;
  const double n = double(trials.size());
  for (const std::vector<double>& trial : trials) result.mean += trial[time] / n;
  double largest = 0;
  for (const std::vector<double>& trial : trials) {
    result.squares += std::pow(trial[time] - result.mean, 2);
    largest = std::max(largest, std::abs(trial[time]));
  }
  if (std::sqrt(result.squares / n) <= 1e-12 * largest) result.squares = 0;  // equal but for rounding
  return result;
}

/// The largest |t| over all times in each draw.
std::vector<double> largest_t(const std::vector<std::vector<double>>& deviations, const std::vector<double>& squares,
                              std::uint64_t seed) {
  const double n = double(deviations.size());
  std::vector<double> all(kDraws), sums(squares.size());
  for (std::size_t draw = 0; draw < kDraws; ++draw) {
    Random random(seed, draw);
    std::fill(sums.begin(), sums.end(), 0.0);
    for (const std::vector<double>& trial : deviations) {
      const double sign = random.uniform() < 0.5 ? -1 : 1;
      for (std::size_t k = 0; k < sums.size(); ++k) sums[k] += sign * trial[k];
    }
    for (std::size_t k = 0; k < sums.size(); ++k) {
      const double left = std::max(squares[k] - sums[k] * sums[k] / n, 1e-12 * squares[k]);
      if (squares[k] > 0) all[draw] = std::max(all[draw], std::abs(sums[k]) / std::sqrt(n * left / (n - 1)));
    }
  }
  return all;
}

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

std::optional<MeanOfFrames> mean_of_frames(const std::vector<double>& values, double confidence) {
  check_confidence(confidence);
  if (values.size() < kFewestFrames) return std::nullopt;
  check_finite(values, "value");
  const double n = double(values.size()), mean = mean_of(values);
  double squares = 0;
  for (const double value : values) squares += (value - mean) * (value - mean);
  if (!(std::sqrt(squares / n) > 1e-12 * std::abs(mean))) return std::nullopt;
  MeanOfFrames result;
  result.freedom = freedom_of(values, mean);
  const double variance = long_run_variance(values, mean, result.freedom);
  const double half = student_quantile(1 - confidence, result.freedom) * std::sqrt(variance / n);
  result.interval = {mean - half, mean + half, confidence};
  result.effective_frames = variance > 0 ? std::clamp(squares / (n - 1) * n / variance, 1.0, n) : n;
  return result;
}

std::optional<CurveLag> best_lag(const PairedCurves& pair) {
  const Raster raster(pair);
  std::size_t both = 0;
  for (const double difference : pair.difference) both += std::isfinite(difference);
  const std::size_t least = std::max(kFewestFrames, (both + 1) / 2);
  const long most = long(std::min(raster.first.size() / 4, kMostLags));
  std::vector<std::optional<double>> all;
  for (long lag = -most; lag <= most; ++lag) all.push_back(raster.correlation(lag, least));
  std::size_t best = std::size_t(most);  // no lag, unless another one is better
  for (std::size_t steps = 1; steps <= std::size_t(most); ++steps)
    for (const std::size_t i : {std::size_t(most) + steps, std::size_t(most) - steps})
      if (all[i] && (!all[best] || *all[i] > *all[best] + kSameCorrelation)) best = i;
  if (best == 0 || best + 1 >= all.size() || !all[best - 1] || !all[best] || !all[best + 1]) return std::nullopt;
  const double before = *all[best - 1], at = *all[best], after = *all[best + 1], bend = before - 2 * at + after;
  const bool is_symmetric = std::abs(before - after) < kSameCorrelation || bend > -kSameCorrelation;
  const double part = is_symmetric ? 0 : 0.5 * (before - after) / bend;
  return CurveLag{(double(best) - double(most) + part) * pair.step, at - 0.25 * (before - after) * part};
}

CurveDifference difference_of(const PairedCurves& pair) {
  CurveDifference result;
  std::vector<double> first, second, differences;
  double squares = 0;
  for (std::size_t i = 0; i < pair.at.size(); ++i) {
    const bool in_first = std::isfinite(pair.first[i]), in_second = std::isfinite(pair.second[i]);
    result.times += in_first || in_second;
    result.only_first += in_first && !in_second;
    result.only_second += in_second && !in_first;
    if (!in_first || !in_second) continue;
    first.push_back(pair.first[i]);
    second.push_back(pair.second[i]);
    differences.push_back(pair.difference[i]);
    squares += pair.difference[i] * pair.difference[i];
    if (differences.size() == 1 || std::abs(pair.difference[i]) > std::abs(result.largest)) {
      result.largest = pair.difference[i];
      result.largest_at = pair.at[i];
    }
  }
  result.both = differences.size();
  if (result.both == 0) throw Error("there is no time at which both sequences have a value");
  result.bias = mean_of(differences);
  result.rms = std::sqrt(squares / double(result.both));
  result.mean = mean_of_frames(differences);
  result.correlation = result.both < 2 ? std::nullopt : correlation_of(first, second);
  result.lag = best_lag(pair);
  if (result.both < 2) return result;
  double spread = 0;
  for (const double difference : differences) spread += (difference - result.bias) * (difference - result.bias);
  result.deviation = std::sqrt(spread / double(result.both - 1));
  const double half = z_of_tail(0.025) * *result.deviation;
  result.agreement = Interval{result.bias - half, result.bias + half, 0.95};
  return result;
}

CurveBand mean_band(const std::vector<std::vector<double>>& trials, std::uint64_t seed) {
  if (trials.size() < kFewestTrials)
    throw Error(formatted("a band over trials needs at least {}, got {}", kFewestTrials, trials.size()));
  const std::size_t times = trials.front().size();
  for (const std::vector<double>& trial : trials)
    if (trial.size() != times)
      throw Error(formatted("the trials have curves of unlike length: {} and {} times", times, trial.size()));
  const double n = double(trials.size());
  CurveBand band;
  band.trials = trials.size();
  std::vector<double> errors, squares;
  std::vector<std::vector<double>> deviations(trials.size());
  for (std::size_t time = 0; time < times; ++time) {
    const Moments at = moments_at(trials, time);
    band.mean.push_back(at.mean);
    errors.push_back(std::sqrt(at.squares / (n - 1) / n));
    if (!std::isfinite(at.mean)) continue;
    squares.push_back(at.squares);
    for (std::size_t i = 0; i < trials.size(); ++i) deviations[i].push_back(trials[i][time] - at.mean);
  }
  const double most = quantile(largest_t(deviations, squares, seed), 1 - kOutside);
  const double pointwise = student_quantile(kOutside, n - 1);
  for (const double error : errors) {
    band.pointwise.push_back(pointwise * error);
    band.simultaneous.push_back(std::max(most, pointwise) * error);
  }
  return band;
}

std::optional<Interval> mean_of_trials(const std::vector<double>& values) {
  if (values.size() < 2) return std::nullopt;
  std::vector<std::vector<double>> trials;
  for (const double value : values) trials.push_back({value});
  const Moments all = moments_at(trials, 0);
  const double n = double(values.size());
  const double half = student_quantile(kOutside, n - 1) * std::sqrt(all.squares / (n - 1) / n);
  return Interval{all.mean - half, all.mean + half, 1 - kOutside};
}

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
