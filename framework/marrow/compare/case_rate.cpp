// SPDX-License-Identifier: Apache-2.0
#include "marrow/compare/case_rate.hpp"

#include <algorithm>

#include "distributions.hpp"
#include "marrow/base/error.hpp"
#include "value_checks.hpp"

namespace marrow::compare {
namespace {

constexpr double kWeightOfExtremes = 0.25;  // of each of the two cases that are added to the variance

double squared(double value) { return value * value; }

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

}  // namespace marrow::compare
