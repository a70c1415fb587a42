// SPDX-License-Identifier: Apache-2.0
#include "marrow/compare/curve_band.hpp"

#include <algorithm>
#include <cmath>

#include "distributions.hpp"
#include "marrow/base/error.hpp"
#include "marrow/base/number_text.hpp"
#include "marrow/domain/quantile.hpp"
#include "marrow/domain/random.hpp"

namespace marrow::compare {
namespace {

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

}  // namespace

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

}  // namespace marrow::compare
