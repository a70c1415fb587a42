// SPDX-License-Identifier: Apache-2.0
#include "marrow/compare/experiment_notes.hpp"

#include <cmath>

#include "marrow/base/number_text.hpp"
#include "marrow/compare/case_rate.hpp"
#include "marrow/compare/median_interval.hpp"
#include "marrow/compare/paired.hpp"

namespace marrow::compare {
namespace {

std::string note_of_comparisons(const Experiment& experiment) {
  const auto [comparisons, cases, fewest] = comparison_counts(experiment);
  if (cases >= fewest) return "";
  return formatted(
      "{} cannot show a difference{}: even if all go the same way, p stays above 0.05{}; it takes at least {}",
      counted(cases, experiment.tune ? "held-out case" : "case"),
      comparisons == 1 ? "" : formatted(" among {} comparisons", comparisons),
      comparisons == 1 ? "" : " after Holm's correction", fewest);
}

/// Why no result of the cells can meet the rule at its last look; empty if one can.
std::string fault_of_last_look(const StopRule& rule, std::size_t starts) {
  const double level = StopPlan(rule).level_at(rule.most_cases);
  const std::string fewest = formatted("{}", fewest_cases(level));
  if (rule.goal == StopRule::Goal::difference)
    return rule.most_cases < fewest_cases(level)
               ? formatted("p must be below {:.2g}, which takes at least {} cases", level, fewest)
               : "";
  if (rule.metric) {
    const std::vector<double> equal(rule.most_cases, 0.0);  // as narrow as an interval can be
    return std::isfinite(order_statistic_interval(equal, level).lower)
               ? ""
               : "there is no interval of a median with its confidence, which takes at least " + fewest + " cases";
  }
  CaseRate best;  // all runs independent
  for (std::size_t run = 0; run < rule.most_cases * starts; ++run) best.add(formatted("{}", run), true);
  const Interval narrowest = best.exact_interval(1 - level);
  const double width = narrowest.upper - narrowest.lower;
  return width > rule.width
             ? formatted("the interval of a success rate is at least {:.2g} wide, even if every run is a success",
                         width)
             : "";
}

}  // namespace

ComparisonCounts comparison_counts(const Experiment& experiment) {
  ComparisonCounts counts;
  counts.cases = experiment.cases.size() - (experiment.tune ? experiment.tune->training_cases : 0);
  const std::size_t variants = experiment.variants.size() + (experiment.tune ? 1 : 0);
  counts.comparisons =
      (experiment.compare_all ? variants * (variants - 1) / 2 : variants - 1) * experiment.metrics.size();
  if (counts.comparisons) counts.fewest_cases = fewest_cases(0.05, counts.comparisons);
  return counts;
}

std::vector<std::string> notes_of(const Experiment& experiment) {
  std::vector<std::string> notes;
  if (std::string note = note_of_comparisons(experiment); !note.empty()) notes.push_back(std::move(note));
  if (experiment.stop)
    if (const std::string fault = fault_of_last_look(*experiment.stop, experiment.starts.size()); !fault.empty())
      notes.push_back("the rule under 'stop' can never be met: at its last look, at " +
                      counted(experiment.stop->most_cases, "case") + ", " + fault);
  if (!experiment.initial_error.empty() && !experiment.defines_success())
    notes.push_back("there is no capture range over '" + experiment.initial_error +
                    "': without limits under 'success', no run is a success or a miss");
  return notes;
}

}  // namespace marrow::compare
