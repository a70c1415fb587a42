// SPDX-License-Identifier: Apache-2.0
// What the rows of a comparison say: of each variant, and of each against the baseline.
#include <algorithm>
#include <cmath>
#include <map>
#include <set>

#include "compare/comparison.hpp"
#include "compare/figure_units.hpp"
#include "compare/times.hpp"

namespace marrow::cli {
namespace {

using compare::CellRow;
using compare::Experiment;
using Rows = RowsOfVariant;

VariantFigure figure_of(const std::vector<double>& values, std::size_t of, bool higher_is_better = false) {
  VariantFigure figure;
  figure.count = values.size();
  figure.of = of;
  if (!values.empty()) figure.summary = compare::summarise(values, higher_is_better);
  return figure;
}

bool has_all_figures(const CellRow& row) {
  return std::find(row.values.begin(), row.values.end(), std::nullopt) == row.values.end();
}

/// Counts silent failures and false alarms.
VerdictCounts verdict_counts(const Experiment& experiment, const Rows& rows) {
  VerdictCounts counts;
  compare::CaseRate silent, false_alarms;
  for (const CellRow* row : rows) {
    if (!row->verdict) continue;
    ++counts.cells;
    if (!experiment.defines_success()) continue;
    const bool is_trusted = *row->verdict == Judgement::trusted;
    if (row->is_success(experiment))
      false_alarms.add(row->case_name, !is_trusted);
    else
      silent.add(row->case_name, is_trusted);
  }
  counts.misses = silent.runs();
  counts.successes = false_alarms.runs();
  counts.silent = silent.successes();
  counts.false_alarms = false_alarms.successes();
  if (silent.runs()) counts.silent_rate = silent.interval();
  if (false_alarms.runs()) counts.false_alarm_rate = false_alarms.interval();
  return counts;
}

VariantSummary summary_of(const Experiment& experiment, const Rows& rows,
                          const std::set<std::pair<std::string, std::string>>& done_by_all) {
  VariantSummary summary;
  summary.runs = rows.size();
  if (experiment.defines_success()) summary.success.emplace();
  std::vector<double> seconds, evaluations;
  for (const CellRow* row : rows) {
    const bool is_done = row->failed.empty();
    summary.failed += !is_done;
    summary.incomplete += is_done && !has_all_figures(*row);
    if (summary.success) summary.success->add(row->case_name, row->is_success(experiment));
    if (row->seconds) seconds.push_back(*row->seconds);
    if (is_done && row->absent.empty() && done_by_all.contains({row->case_name, row->start}))
      evaluations.push_back(row->evaluations);
  }
  for (std::size_t m = 0; m < experiment.metrics.size(); ++m) {
    const FigureOfCases values = figure_of_cases(rows, m);
    summary.figures.push_back(figure_of(values.all, rows.size(), experiment.metrics[m].higher_is_better()));
    summary.figures.back().median = values.median_interval();
  }
  summary.seconds = figure_of(seconds, rows.size());
  summary.evaluations = figure_of(evaluations, rows.size());
  summary.verdicts = verdict_counts(experiment, rows);
  return summary;
}

/// Errors of the starts, by case and start. For a run that failed, another variant with the same start gives its error.
using StartErrors = std::map<std::pair<std::string, std::string>, double>;

StartErrors start_errors(const std::vector<CellRow>& rows) {
  StartErrors errors;
  for (const CellRow& row : rows)
    if (row.initial_error) errors.emplace(std::pair(row.case_name, row.start), *row.initial_error);
  return errors;
}

void add_capture(const Experiment& experiment, const Rows& rows, const StartErrors& errors, VariantSummary& summary) {
  std::vector<compare::StartOutcome> outcomes;
  for (const CellRow* one : rows) {
    const CellRow& row = *one;
    const auto known = errors.find({row.case_name, row.start});
    if (row.initial_error || known != errors.end())
      outcomes.push_back({std::abs(row.initial_error ? *row.initial_error : known->second), row.is_success(experiment),
                          row.case_name});
    else
      ++summary.unknown_starts;
  }
  summary.capture = compare::capture_range(outcomes);
}

/// Whether all variants have a metric in the same cases and starts.
bool is_of_same_runs(const std::vector<Rows>& of_variant, std::size_t metric) {
  std::set<std::set<std::pair<std::string, std::string>>> different;
  for (const Rows& rows : of_variant) {
    std::set<std::pair<std::string, std::string>> places;
    for (const CellRow* row : rows)
      if (row->values[metric]) places.emplace(row->case_name, row->start);
    different.insert(std::move(places));
  }
  return different.size() < 2;
}

std::optional<compare::Interval> rate_of(const Experiment& experiment, const RowsOfVariant& rows, double confidence) {
  compare::CaseRate rate;
  for (const compare::CellRow* row : rows) rate.add(row->case_name, row->is_success(experiment));
  return rate.runs() ? std::optional(rate.exact_interval(confidence)) : std::nullopt;
}

/// Applies the rule 'stop' of the experiment, if it has one, to its cases so far. The units are known.
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
    std::vector<std::optional<compare::Interval>> intervals;
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

}  // namespace

Answer answer_of(const Experiment& experiment, const std::vector<CellRow>& rows) {
  FigureUnits units(experiment);
  units.add(rows);
  Answer answer;
  answer.units = units.of_metrics();
  answer.initial_error_unit = units.of_initial_error();
  const StartErrors errors = start_errors(rows);
  const std::vector<Rows> of_variant = rows_by_variant(experiment, rows);
  const auto done_by_all = places_done_by_all(of_variant);
  for (const Rows& own : of_variant) {
    answer.variants.push_back(summary_of(experiment, own, done_by_all));
    if (!experiment.initial_error.empty() && experiment.defines_success())
      add_capture(experiment, own, errors, answer.variants.back());
  }
  for (std::size_t m = 0; m < experiment.metrics.size(); ++m)
    answer.same_runs.push_back(is_of_same_runs(of_variant, m));
  add_look(experiment, of_variant, answer);
  answer.curves = curves_of(experiment, of_variant);
  add_findings(experiment, of_variant, answer);
  add_effects(experiment, of_variant, answer);
  return answer;
}

}  // namespace marrow::cli
