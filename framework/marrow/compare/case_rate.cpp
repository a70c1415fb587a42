// SPDX-License-Identifier: Apache-2.0
#include "marrow/compare/case_rate.hpp"

#include <algorithm>
#include <cmath>

#include "marrow/base/error.hpp"
#include "marrow/base/number_text.hpp"

namespace marrow::compare {
namespace {

constexpr double kWeightOfExtremes = 0.25;  // of each of the two cases that are added to the variance

double squared(double value) { return value * value; }

constexpr std::size_t kMostBins = 100;  // the last one holds all starts that are farther

}  // namespace

void CaseRate::add(const std::string& case_name, bool is_success) {
  Counts& counts = cases_[case_name];
  ++counts.runs;
  ++runs_;
  counts.successes += is_success;
  successes_ += is_success;
}

double CaseRate::effective_runs() const {
  if (!runs_) throw Error("a success rate of no runs has no interval; give at least one run");
  const double runs = double(runs_), w = kWeightOfExtremes;
  const double mean_runs = runs / double(cases_.size()), weights = double(cases_.size()) + 2 * w,
               all_runs = runs + 2 * w * mean_runs, rate = (double(successes_) + w * mean_runs) / all_runs;
  double squares = w * (squared(mean_runs * (1 - rate)) + squared(mean_runs * rate)), runs_squared = 0;
  for (const auto& [name, counts] : cases_) {
    squares += squared(double(counts.successes) - double(counts.runs) * rate);
    runs_squared += squared(double(counts.runs));
  }
  const double variance = weights / (weights - 1) * squares / squared(all_runs);
  const double independent = rate * (1 - rate) / all_runs;
  const double most = runs_squared / runs;  // if all runs of a case end alike
  return runs / std::clamp(variance / independent, 1.0, most);
}

Interval CaseRate::interval(double confidence) const {
  check_confidence(confidence);
  return score_interval(double(successes_) / double(runs_ ? runs_ : 1), effective_runs(), confidence);
}

Interval CaseRate::exact_interval(double confidence) const {
  check_confidence(confidence);
  const double runs = effective_runs(), tail = (1 - confidence) / 2;
  const double successes = runs * double(successes_) / double(runs_), others = runs - successes;
  return {successes_ == 0 ? 0 : beta_quantile(tail, successes, others + 1),
          successes_ == runs_ ? 1 : beta_quantile(1 - tail, successes + 1, others), confidence};
}

CaptureRange capture_range(const std::vector<StartOutcome>& outcomes, double bin_width, double least_rate) {
  if (!(bin_width > 0)) throw Error(formatted("the width of a bin is {:f}; give a positive one", bin_width));
  if (!(least_rate >= 0 && least_rate <= 1))
    throw Error(formatted("the success rate is {:f}; give a fraction from 0 to 1, such as 0.95", least_rate));
  CaptureRange capture;
  std::vector<CaseRate> rates;
  double farthest = 0;
  for (const StartOutcome& outcome : outcomes) {
    if (!(outcome.error >= 0 && std::isfinite(outcome.error)))
      throw Error(
          formatted("the error of a start is {:f}, which is no distance; leave runs out whose start is not known",
                    outcome.error));
    farthest = std::max(farthest, outcome.error);
    const std::size_t bin = std::size_t(std::min(outcome.error / bin_width, double(kMostBins - 1)));
    while (capture.bins.size() <= bin) {
      const double from = bin_width * double(capture.bins.size());
      capture.bins.push_back({from, from + bin_width, 0, 0, {0, 1, 0.95}});
    }
    rates.resize(capture.bins.size());
    const std::size_t number = std::size_t(&outcome - outcomes.data());
    rates[bin].add(outcome.case_name.empty() ? formatted(" {}", number) : outcome.case_name, outcome.success);
  }
  if (!capture.bins.empty()) capture.bins.back().to = std::max(capture.bins.back().to, farthest);
  capture.is_open = !outcomes.empty();
  for (std::size_t b = 0; b < capture.bins.size(); ++b) {
    CaptureRange::Bin& bin = capture.bins[b];
    bin.runs = rates[b].runs();
    bin.successes = rates[b].successes();
    if (!bin.runs) continue;
    bin.success = rates[b].interval();
    capture.is_open = capture.is_open && double(bin.successes) >= least_rate * double(bin.runs);
    if (capture.is_open) capture.range = bin.to;
  }
  if (capture.is_open) capture.range = farthest;
  return capture;
}

}  // namespace marrow::compare
