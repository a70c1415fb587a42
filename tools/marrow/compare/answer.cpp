// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <map>
#include <sstream>

#include "compare/comparison.hpp"
#include "marrow/compare/bootstrap.hpp"
#include "marrow/domain/number_text.hpp"
#include "marrow/domain/printable.hpp"

namespace marrow::cli {
namespace {

using compare::CellRow;
using compare::Experiment;

constexpr std::uint64_t kBootstrapSeed = 1;

VariantFigure figure_of(const std::vector<double>& values, bool higher_is_better = false) {
  VariantFigure figure;
  figure.count = values.size();
  if (!values.empty()) figure.summary = compare::summarise(values, higher_is_better);
  return figure;
}

VariantFigure figure_by_case(const std::map<std::string, std::vector<double>>& values, bool higher_is_better) {
  compare::ValuesOfCases cases;
  std::vector<double> all;
  for (const auto& [name, own] : values) {
    cases.push_back(own);
    all.insert(all.end(), own.begin(), own.end());
  }
  VariantFigure figure = figure_of(all, higher_is_better);
  figure.has_interval = cases.size() > 1;
  if (figure.has_interval)
    figure.median =
        compare::median_of_runs_interval(cases, {kBootstrapSeed, 0.95, compare::resamples_for(all.size()), 0});
  return figure;
}

using Rows = RowsOfVariant;

VariantSummary summary_of(const Experiment& experiment, const Rows& rows) {
  VariantSummary summary;
  std::vector<std::map<std::string, std::vector<double>>> values(experiment.metrics.size());  // by case
  std::vector<double> seconds, evaluations;
  compare::CaseRate success;
  for (const CellRow* one : rows) {
    const CellRow& row = *one;
    success.add(row.case_name, row.is_success(experiment));
    if (!row.failed.empty()) {
      ++summary.failed;
      continue;
    }
    for (std::size_t i = 0; i < values.size(); ++i)
      if (row.values[i]) values[i][row.case_name].push_back(*row.values[i]);
    if (row.seconds) seconds.push_back(*row.seconds);
    evaluations.push_back(row.evaluations);
  }
  summary.runs = success.runs();
  summary.successes = success.successes();
  if (summary.runs) summary.success = success.interval();
  if (summary.runs) summary.effective_runs = success.effective_runs();
  for (std::size_t i = 0; i < values.size(); ++i)
    summary.figures.push_back(figure_by_case(values[i], experiment.metrics[i].higher_is_better()));
  summary.seconds = figure_of(seconds);
  summary.evaluations = figure_of(evaluations);
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

std::string unit_of(const std::vector<CellRow>& rows, std::size_t metric) {
  for (const CellRow& row : rows)
    if (metric < row.units.size() && !row.units[metric].empty()) return row.units[metric];
  return "";
}

/// A table with one row per bin and one column per variant. The last row is the capture range.
std::string capture_text(const Experiment& experiment, const Answer& answer) {
  std::vector<compare::CaptureRange::Bin> longest;
  std::size_t unknown = 0;
  for (const VariantSummary& summary : answer.variants) {
    if (summary.capture.bins.size() > longest.size()) longest = summary.capture.bins;
    unknown += summary.unknown_starts;
  }
  if (longest.empty()) return "";
  std::string text = "\nCapture range: success over " + printable(experiment.initial_error) + ", with 95 % intervals\n";
  char part[100];
  const auto row = [&](const std::string& head, const auto& cell) {
    std::snprintf(part, sizeof part, "%-16s", head.c_str());
    text += part;
    for (std::size_t v = 0; v < answer.variants.size(); ++v) {
      std::snprintf(part, sizeof part, " %-24s", cell(v).c_str());
      text += part;
    }
    text.erase(text.find_last_not_of(' ') + 1);
    text += "\n";
  };
  row("start", [&](std::size_t v) { return experiment.variants[v].name; });
  for (std::size_t b = 0; b < longest.size(); ++b) {
    const std::string bin = formatted("%g to %g", longest[b].from, longest[b].to);
    row(bin, [&](std::size_t v) -> std::string {
      const auto& all = answer.variants[v].capture.bins;
      if (b >= all.size() || !all[b].runs) return "-";
      return formatted("%zu/%zu (%.0f to %.0f %%)", all[b].successes, all[b].runs, 100 * all[b].success.lower,
                       100 * all[b].success.upper);
    });
  }
  row("95 % or more to", [&](std::size_t v) -> std::string {
    return formatted(answer.variants[v].capture.is_open ? "at least %.1f" : "%.1f", answer.variants[v].capture.range);
  });
  if (unknown)
    text += std::to_string(unknown) + " runs failed before the error of their start was known, and do not count here\n";
  return text;
}

/// The figures of one metric, a row for each variant.
std::string figure_table(const Experiment& experiment, const Answer& answer, std::size_t m, int width) {
  const compare::MetricChoice& metric = experiment.metrics[m];
  std::string text = "\n" +
                     printable(metric.label + (answer.units[m].empty() ? "" : " [" + answer.units[m] + "]") +
                               (metric.label == metric.path ? "" : ", " + metric.path)) +
                     "\n" +
                     formatted("%-*s %9s %9s %9s %9s %9s  %s\n", width, "", "median", "25 %", "75 %", "95 %", "worst",
                               "median, 95 % interval");
  for (std::size_t v = 0; v < answer.variants.size(); ++v) {
    const VariantFigure& figure = answer.variants[v].figures[m];
    const compare::Summary& summary = figure.summary;
    const std::string interval =
        figure.has_interval ? formatted("%.4f to %.4f", figure.median.lower, figure.median.upper) : "-";
    const char* name = experiment.variants[v].name.c_str();
    text += figure.count ? formatted("%-*s %9.4f %9.4f %9.4f %9.4f %9.4f  %s\n", width, name, summary.median,
                                     summary.lower_quartile, summary.upper_quartile, summary.percentile_95,
                                     summary.worst, interval.c_str())
                         : formatted("%-*s no cell is done\n", width, name);
  }
  return text;
}

}  // namespace

std::vector<RowsOfVariant> rows_by_variant(const Experiment& experiment, const std::vector<CellRow>& rows) {
  std::map<std::string, std::size_t> places;
  for (std::size_t v = 0; v < experiment.variants.size(); ++v) places[experiment.variants[v].name] = v;
  std::vector<RowsOfVariant> result(experiment.variants.size());
  for (const CellRow& row : rows)
    if (const auto place = places.find(row.variant); place != places.end()) result[place->second].push_back(&row);
  return result;
}

std::vector<compare::Pair> cell_pairs(const RowsOfVariant& baseline, const RowsOfVariant& variant, std::size_t metric) {
  std::map<std::pair<std::string, std::string>, double> reference;
  for (const CellRow* row : baseline)
    if (row->failed.empty() && row->values[metric]) reference[{row->case_name, row->start}] = *row->values[metric];
  std::vector<compare::Pair> pairs;
  for (const CellRow* row : variant) {
    const auto found = reference.find({row->case_name, row->start});
    if (row->failed.empty() && row->values[metric] && found != reference.end())
      pairs.push_back({row->case_name, found->second, *row->values[metric]});
  }
  return pairs;
}

Answer answer_of(const Experiment& experiment, const std::vector<CellRow>& rows) {
  Answer answer;
  const StartErrors errors = start_errors(rows);
  const std::vector<Rows> of_variant = rows_by_variant(experiment, rows);
  for (const Rows& own : of_variant) {
    answer.variants.push_back(summary_of(experiment, own));
    if (!experiment.initial_error.empty()) add_capture(experiment, own, errors, answer.variants.back());
  }
  for (std::size_t m = 0; m < experiment.metrics.size(); ++m) answer.units.push_back(unit_of(rows, m));
  add_look(experiment, of_variant, answer);
  answer.curves = curves_of(experiment, of_variant);
  std::vector<double> p;
  for (std::size_t m = 0; m < experiment.metrics.size(); ++m)
    for (std::size_t v = 0; v < experiment.variants.size(); ++v) {
      if (v == experiment.baseline) continue;
      const std::vector<compare::Pair> pairs = cell_pairs(of_variant[experiment.baseline], of_variant[v], m);
      if (pairs.empty()) continue;
      answer.findings.push_back({v, m, compare::compare_pairs(pairs, kBootstrapSeed), 1, ""});
      p.push_back(answer.findings.back().comparison.test.p);
    }
  const std::vector<double> corrected = compare::holm(p);
  for (std::size_t i = 0; i < corrected.size(); ++i) {
    Finding& finding = answer.findings[i];
    finding.p_holm = corrected[i];
    finding.sentence = compare::sentence(experiment.variants[finding.variant].name,
                                         {experiment.metrics[finding.metric].label, answer.units[finding.metric],
                                          experiment.metrics[finding.metric].higher_is_better()},
                                         finding.comparison, finding.p_holm);
  }
  return answer;
}

std::string table_text(const Experiment& experiment, const Answer& answer) {
  std::ostringstream out;
  std::size_t width = 10;
  for (const compare::Variant& variant : experiment.variants) width = std::max(width, variant.name.size() + 2);
  out << formatted("%-*s %5s %6s  %-22s %9s %12s\n", int(width), "variant", "runs", "failed", "success (95 % interval)",
                   "s", "evaluations");
  for (std::size_t v = 0; v < answer.variants.size(); ++v) {
    const VariantSummary& summary = answer.variants[v];
    const std::string success = formatted("%5.1f %% (%.1f to %.1f)",
                                          summary.runs ? 100.0 * double(summary.successes) / double(summary.runs) : 0.0,
                                          100 * summary.success.lower, 100 * summary.success.upper);
    out << formatted("%-*s %5zu %6zu  %-22s %9.3f %12.0f\n", int(width),
                     (experiment.variants[v].name + (v == experiment.baseline ? " *" : "")).c_str(), summary.runs,
                     summary.failed, success.c_str(), summary.seconds.summary.median,
                     summary.evaluations.summary.median);
  }
  for (std::size_t m = 0; m < experiment.metrics.size(); ++m) out << figure_table(experiment, answer, m, int(width));
  out << verdict_table(experiment, answer) << capture_text(experiment, answer);
  out << "\n* the baseline";
  if (experiment.variants.size() > 1)
    out << "; against it, with Holm's correction over all " << answer.findings.size() << ":\n";
  for (const Finding& finding : answer.findings) out << "  " << printable(finding.sentence) << "\n";
  if (answer.look) {
    out << "\n" << printable(answer.look_sentence) << "\n";
    if (answer.look->number > 1) out << "The other intervals and p do not count the looks.\n";
  }
  return out.str();
}

}  // namespace marrow::cli
