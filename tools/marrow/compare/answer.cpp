// SPDX-License-Identifier: Apache-2.0
// What the rows of a comparison say: of each variant, and of each against the baseline.
#include <algorithm>
#include <cmath>
#include <map>
#include <set>
#include <thread>

#include "compare/comparison.hpp"
#include "marrow/base/number_text.hpp"

namespace marrow::cli {
namespace {

using compare::CellRow;
using compare::Experiment;
using CaseAndStart = std::pair<std::string, std::string>;
using Rows = RowsOfVariant;

bool is_done_without_a_failure(const CellRow& row) { return row.failed.empty() && row.absent.empty(); }

/// The cases and starts in which every variant was done and no node failed. A variant for which there are none does not
/// count. Only these allow to compare amounts of work: otherwise a variant that fails in hard cases would seem faster.
std::set<CaseAndStart> places_done_by_all(const std::vector<RowsOfVariant>& rows) {
  std::map<CaseAndStart, std::size_t> done;
  std::size_t variants = 0;
  for (const RowsOfVariant& own : rows) {
    bool is_anywhere = false;
    for (const CellRow* row : own) {
      if (!is_done_without_a_failure(*row)) continue;
      ++done[{row->case_name, row->start}];
      is_anywhere = true;
    }
    variants += is_anywhere;
  }
  std::set<CaseAndStart> places;
  for (const auto& [place, count] : done)
    if (count == variants) places.insert(place);
  return places;
}

std::string unit_in_words(const std::string& unit) { return unit.empty() ? "no unit" : "the unit '" + unit + "'"; }

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

TimedCells::TimedCells(const Experiment& experiment, const std::vector<CellRow>& rows)
    : asked_(experiment.timed_cells), variants_(experiment.variants.size()) {
  const std::vector<RowsOfVariant> of_variant = rows_by_variant(experiment, rows);
  const std::set<CaseAndStart> by_all = places_done_by_all(of_variant);
  std::vector<std::size_t> timed;  // variants
  for (std::size_t v = 0; v < variants_; ++v) {
    const RowsOfVariant& own = of_variant[v];
    if (std::any_of(own.begin(), own.end(), [](const CellRow* row) { return is_done_without_a_failure(*row); }))
      timed.push_back(v);
    else
      without_any_ += (without_any_.empty() ? "" : ", ") + experiment.variants[v].name;
  }
  std::vector<std::size_t> first_cells;  // of those cases and starts, in the experiment's order
  for (std::size_t i = 0; i < rows.size(); i += variants_)
    if (by_all.contains({rows[i].case_name, rows[i].start})) first_cells.push_back(i);
  places_ = std::min(first_cells.size(), asked_);
  has_fewer_ = places_ < std::min(asked_, rows.size() / variants_);
  for (std::size_t i = 0; i < places_; ++i) {
    for (const std::size_t v : timed) numbers_.push_back(first_cells[i * first_cells.size() / places_] + v);
    std::reverse(timed.begin(), timed.end());
  }
}

void TimedCells::keep_complete(std::vector<CellRow>& rows) {
  std::map<std::size_t, bool> is_complete;  // by case and start
  for (const std::size_t number : numbers_)
    is_complete.try_emplace(number / variants_, true).first->second &= rows[number].seconds.has_value();
  for (std::size_t i = 0; i < rows.size(); ++i)
    if (const auto found = is_complete.find(i / variants_); found == is_complete.end() || !found->second)
      rows[i].seconds.reset();
  for (const auto& [place, complete] : is_complete) lost_ += !complete;
}

std::string TimedCells::sentence(bool has_store) const {
  if (!asked_) return "Times were not measured.";
  std::string text = "Times were not measured";
  text += places_ ? "." : ": there is no case and start in which every variant was done without a failure.";
  if (places_ > lost_)
    text = "Times: " + counted(places_ - lost_, "run") +
           " of each variant, the same cases and starts for all, in turns, one at a time on " +
           counted(std::thread::hardware_concurrency(), "thread") +
           " with nothing else running. Each cell runs once before, which does not count. " +
           (has_store ? "What all variants share is read back, everything else is made anew."
                      : "Everything is made anew, also what all variants share.");
  if (has_fewer_ && places_) text += " In no other case and start was every variant done without a failure.";
  if (!without_any_.empty()) text += " Without times: " + without_any_ + ", which was done nowhere without a failure.";
  if (lost_)
    text += " Left out: " + counted(lost_, "case and start", "cases and starts") +
            " in which a run failed while it was timed.";
  return text;
}

FigureUnits::FigureUnits(const compare::Experiment& experiment) {
  for (const compare::MetricChoice& metric : experiment.metrics) figures_.push_back({metric.path, "", ""});
  figures_.push_back({experiment.initial_error, "", ""});
}

void FigureUnits::add(const std::vector<compare::CellRow>& rows) {
  for (const compare::CellRow& row : rows) {
    for (std::size_t m = 0; m + 1 < figures_.size(); ++m)
      if (row.values[m]) add(figures_[m], row.units[m], row.id);
    if (row.initial_error) add(figures_.back(), row.initial_error_unit, row.id);
  }
}

void FigureUnits::add(Figure& figure, const std::string& unit, const std::string& cell) {
  if (figure.cell.empty()) {
    figure.unit = unit;
    figure.cell = cell;
  }
  if (unit == figure.unit) return;
  throw Error("the figure '" + figure.path + "' has " + unit_in_words(figure.unit) + " in the cell " + figure.cell +
              " and " + unit_in_words(unit) + " in the cell " + cell +
              ", so their numbers cannot be compared; let all cells give it in one unit");
}

std::vector<std::string> FigureUnits::of_metrics() const {
  std::vector<std::string> units;
  for (std::size_t m = 0; m + 1 < figures_.size(); ++m) units.push_back(figures_[m].unit);
  return units;
}

// The figures of a comparison's rows, as the statistics take them.

using compare::CellRow;

std::vector<RowsOfVariant> rows_by_variant(const compare::Experiment& experiment, const std::vector<CellRow>& rows) {
  std::map<std::string, std::size_t> places;
  for (std::size_t v = 0; v < experiment.variants.size(); ++v) places[experiment.variants[v].name] = v;
  std::vector<RowsOfVariant> result(experiment.variants.size());
  for (const CellRow& row : rows)
    if (const auto place = places.find(row.variant); place != places.end()) result[place->second].push_back(&row);
  return result;
}

FigureOfCases figure_of_cases(const RowsOfVariant& rows, std::size_t metric) {
  std::map<std::string, std::vector<double>> by_case;
  FigureOfCases figure;
  for (const CellRow* row : rows)
    if (row->values[metric]) {
      by_case[row->case_name].push_back(*row->values[metric]);
      figure.all.push_back(*row->values[metric]);
    }
  for (auto& [name, values] : by_case) figure.cases.push_back(std::move(values));
  return figure;
}

std::optional<compare::Interval> FigureOfCases::median_interval(double confidence) const {
  if (cases.empty()) return std::nullopt;
  return compare::median_interval_of(cases, confidence);
}

std::vector<compare::Pair> cell_pairs(const RowsOfVariant& baseline, const RowsOfVariant& variant, std::size_t metric) {
  std::map<std::pair<std::string, std::string>, compare::Pair> by_place;
  const auto pair_of = [&](const CellRow& row) -> compare::Pair& {
    compare::Pair& pair = by_place[{row.case_name, row.start}];
    pair.case_name = row.case_name;
    return pair;
  };
  for (const CellRow* row : baseline) pair_of(*row).reference = row->values[metric];
  for (const CellRow* row : variant) pair_of(*row).variant = row->values[metric];
  std::vector<compare::Pair> pairs;
  for (auto& [place, pair] : by_place) pairs.push_back(std::move(pair));
  return pairs;
}

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
