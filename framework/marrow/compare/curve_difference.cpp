// SPDX-License-Identifier: Apache-2.0
#include "marrow/compare/curve_difference.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <numeric>

#include "distributions.hpp"
#include "marrow/base/error.hpp"
#include "value_checks.hpp"

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

}  // namespace marrow::compare
