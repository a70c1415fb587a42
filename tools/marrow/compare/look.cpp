// SPDX-License-Identifier: Apache-2.0
// What the rule of an experiment, under 'stop', says of the cases so far.
#include "compare/comparison.hpp"

namespace marrow::cli {
namespace {

using compare::Experiment;
using compare::Interval;

std::optional<Interval> rate_of(const Experiment& experiment, const RowsOfVariant& rows, double confidence) {
  compare::CaseRate rate;
  for (const compare::CellRow* row : rows) rate.add(row->case_name, row->is_success(experiment));
  return rate.runs() ? std::optional(rate.exact_interval(confidence)) : std::nullopt;
}

}  // namespace

void add_look(const Experiment& experiment, const std::vector<RowsOfVariant>& rows, Answer& answer) {
  if (!experiment.stop) return;
  const compare::StopRule& rule = *experiment.stop;
  const compare::StopPlan plan(rule);
  const std::size_t cases = experiment.cases.size();
  if (rule.goal == compare::StopRule::Goal::difference) {
    answer.look = compare::look_at_difference(plan, cases,
                                              cell_pairs(rows[experiment.baseline], rows[rule.variant], *rule.metric),
                                              experiment.metrics[*rule.metric].higher_is_better());
  } else {
    std::vector<std::optional<Interval>> intervals;
    const double confidence = 1 - plan.level_at(cases);
    for (const RowsOfVariant& own : rows)
      intervals.push_back(rule.metric ? figure_of_cases(own, *rule.metric).median_interval(confidence)
                                      : rate_of(experiment, own, confidence));
    answer.look = compare::look_at_widths(plan, cases, intervals);
  }
  answer.look_sentence =
      compare::sentence(rule, *answer.look,
                        {rule.metric ? experiment.metrics[*rule.metric].label : "the success rate",
                         rule.metric ? answer.units[*rule.metric] : "", experiment.variants[answer.look->variant].name,
                         experiment.variants[experiment.baseline].name});
}

}  // namespace marrow::cli
