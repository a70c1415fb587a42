// SPDX-License-Identifier: Apache-2.0
// What the rule of an experiment, under 'stop', says of the cases so far.
#include "compare/comparison.hpp"
#include "marrow/compare/bootstrap.hpp"

namespace marrow::cli {
namespace {

using compare::Experiment;
using compare::Interval;

/// The interval of the median of a variant's figure; nothing if fewer than two cases have a value.
std::optional<Interval> median_of(const RowsOfVariant& rows, std::size_t metric, double confidence) {
  std::map<std::string, std::vector<double>> by_case;
  std::size_t runs = 0;
  for (const compare::CellRow* row : rows)
    if (row->failed.empty() && row->values[metric]) {
      by_case[row->case_name].push_back(*row->values[metric]);
      ++runs;
    }
  if (by_case.size() < 2) return std::nullopt;
  compare::ValuesOfCases cases;
  for (auto& [name, values] : by_case) cases.push_back(std::move(values));
  compare::BootstrapSettings settings;
  settings.confidence = confidence;
  settings.resamples = compare::resamples_for(runs);
  return compare::median_of_runs_interval(cases, settings);
}

std::optional<Interval> rate_of(const Experiment& experiment, const RowsOfVariant& rows, double confidence) {
  compare::CaseRate rate;
  for (const compare::CellRow* row : rows) rate.add(row->case_name, row->is_success(experiment));
  return rate.runs() ? std::optional(rate.interval(confidence)) : std::nullopt;
}

}  // namespace

void add_look(const Experiment& experiment, const std::vector<RowsOfVariant>& rows, Answer& answer) {
  if (!experiment.stop) return;
  const compare::StopRule& rule = *experiment.stop;
  const compare::StopPlan plan(rule);
  const std::size_t cases = experiment.cases.size();
  if (rule.goal == compare::StopRule::Goal::difference) {
    answer.look = compare::look_at_difference(plan, cases,
                                              cell_pairs(rows[experiment.baseline], rows[rule.variant], *rule.metric));
  } else {
    std::vector<std::optional<Interval>> intervals;
    const double confidence = 1 - plan.level_at(cases);
    for (const RowsOfVariant& own : rows)
      intervals.push_back(rule.metric ? median_of(own, *rule.metric, confidence)
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
