// SPDX-License-Identifier: Apache-2.0
// The answer of a comparison as tables for the terminal.
#include "compare/comparison.hpp"
#include "compare/text_table.hpp"
#include "marrow/base/number_text.hpp"
#include "marrow/base/printable.hpp"

namespace marrow::cli {
namespace {

using compare::Experiment;

constexpr const char* kNone = "-";

/// "errors.start.axial_deg [deg]".
std::string with_unit(const std::string& name, const std::string& unit) {
  return unit.empty() ? name : name + " [" + unit + "]";
}

std::string success_text(const compare::CaseRate& success) {
  if (!success.runs()) return kNone;
  const compare::Interval interval = success.interval();
  return percent_text(double(success.successes()) / double(success.runs()), 1) + " % (" +
         percent_text(interval.lower, 1) + " to " + percent_text(interval.upper, 1) + ")";
}

/// A row for each variant: how many of its runs failed and succeeded, and what they cost.
std::string overview(const Experiment& experiment, const Answer& answer) {
  using enum Side;
  TextTable table({left, right, right, right, left, right, right});
  table.add({"variant", "runs", "failed", "incomplete", "success (95 % interval)", "s", "evaluations"});
  std::vector<double> seconds;
  for (const VariantSummary& summary : answer.variants)
    if (summary.seconds.count) seconds.push_back(summary.seconds.summary.median);
  const NumberScale scale(seconds);
  for (std::size_t v = 0; v < answer.variants.size(); ++v) {
    const VariantSummary& summary = answer.variants[v];
    table.add({experiment.variants[v].name + (v == experiment.baseline ? " *" : ""), formatted("{}", summary.runs),
               formatted("{}", summary.failed), formatted("{}", summary.incomplete),
               summary.success ? success_text(*summary.success) : kNone,
               summary.seconds.count ? scale.text(summary.seconds.summary.median) : kNone,
               summary.evaluations.count ? formatted("{:.10g}", summary.evaluations.summary.median) : kNone});
  }
  std::string text = table.text();
  if (!experiment.defines_success())
    text += std::string("The experiment has no limits under 'success', so no run is a success or a miss") +
            (experiment.initial_error.empty() ? ".\n" : ", and there is no capture range.\n");
  return text;
}

/// All numbers of one metric have one scale.
NumberScale scale_of(const Answer& answer, std::size_t m) {
  std::vector<double> numbers;
  for (const VariantSummary& summary : answer.variants) {
    const VariantFigure& figure = summary.figures[m];
    const compare::Summary& of = figure.summary;
    if (figure.count)
      numbers.insert(numbers.end(), {of.median, of.lower_quartile, of.upper_quartile, of.percentile_95, of.worst});
    if (figure.median) numbers.insert(numbers.end(), {figure.median->lower, figure.median->upper});
  }
  return NumberScale(numbers);
}

/// The figures of one metric, a row for each variant.
std::string figure_table(const Experiment& experiment, const Answer& answer, std::size_t m) {
  const compare::MetricChoice& metric = experiment.metrics[m];
  using enum Side;
  TextTable table({left, right, right, right, right, right, right, left});
  table.add({"", "runs", "median", "25 %", "75 %", metric.higher_is_better() ? "5 %" : "95 %", "worst",
             "median, 95 % interval"});
  const NumberScale scale = scale_of(answer, m);
  for (std::size_t v = 0; v < answer.variants.size(); ++v) {
    const VariantFigure& figure = answer.variants[v].figures[m];
    const auto text = [&](double value) { return figure.count ? scale.text(value) : kNone; };
    const compare::Summary& of = figure.summary;
    table.add({experiment.variants[v].name, formatted("{}/{}", figure.count, figure.of), text(of.median),
               text(of.lower_quartile), text(of.upper_quartile), text(of.percentile_95), text(of.worst),
               figure.median ? scale.text(figure.median->lower) + " to " + scale.text(figure.median->upper) : kNone});
  }
  const std::string title =
      with_unit(metric.label, answer.units[m]) + (metric.label == metric.path ? "" : ", " + metric.path);
  return "\n" + printable(title) + "\n" + table.text() +
         (answer.same_runs[m] ? ""
                              : "The variants have this figure in different runs, so these numbers are not of the same "
                                "cases and starts.\n");
}

/// What the verdicts of each variant are worth; empty if no cell has a verdict.
std::string verdict_table(const Experiment& experiment, const Answer& answer) {
  std::size_t cells = 0;
  for (const VariantSummary& summary : answer.variants) cells += summary.verdicts.cells;
  if (!cells) return "";
  using enum Side;
  TextTable table({left, right, left, right, left});
  table.add({"", "cells", "silent failures", "caught", "false alarms"});
  for (std::size_t v = 0; v < answer.variants.size(); ++v) {
    const VerdictCounts& counts = answer.variants[v].verdicts;
    table.add({experiment.variants[v].name, formatted("{}", counts.cells),
               rate_text(counts.silent, counts.misses, counts.silent_rate, 1),
               experiment.defines_success() ? formatted("{}", counts.caught()) : kNone,
               rate_text(counts.false_alarms, counts.successes, counts.false_alarm_rate, 1)});
  }
  return "\nVerdicts: misses that are trusted, of all misses; successes that are not, of all successes\n" +
         table.text();
}

std::vector<compare::CaptureRange::Bin> longest_bins(const Answer& answer) {
  std::vector<compare::CaptureRange::Bin> longest;
  for (const VariantSummary& summary : answer.variants)
    if (summary.capture && summary.capture->bins.size() > longest.size()) longest = summary.capture->bins;
  return longest;
}

/// A row for each bin and a column for each variant. The last row is the capture range.
std::string capture_text(const Experiment& experiment, const Answer& answer) {
  const std::vector<compare::CaptureRange::Bin> longest = longest_bins(answer);
  if (longest.empty()) return "";
  TextTable table(std::vector<Side>(answer.variants.size() + 1, Side::left));
  const auto add = [&](const std::string& head, const auto& cell) {
    std::vector<std::string> row{head};
    for (std::size_t v = 0; v < answer.variants.size(); ++v) row.push_back(cell(v));
    table.add(row);
  };
  add("start", [&](std::size_t v) { return experiment.variants[v].name; });
  for (std::size_t b = 0; b < longest.size(); ++b)
    add(formatted("{:g} to {:g}", longest[b].from, longest[b].to), [&](std::size_t v) {
      const auto& bins = answer.variants[v].capture->bins;
      return b < bins.size() ? rate_text(bins[b].successes, bins[b].runs, bins[b].success, 0) : kNone;
    });
  add("95 % or more to", [&](std::size_t v) {
    return (answer.variants[v].capture->is_open ? "at least " : "") +
           short_number(answer.variants[v].capture->range, 4);
  });
  std::size_t unknown = 0;
  for (const VariantSummary& summary : answer.variants) unknown += summary.unknown_starts;
  std::string text = formatted(
      "\nCapture range: success over {}, in bins of {:g}{}, with 95 % intervals\n{}",
      printable(with_unit(experiment.initial_error, answer.initial_error_unit)), longest[0].to - longest[0].from,
      answer.initial_error_unit.empty() ? "" : " " + printable(answer.initial_error_unit), table.text());
  if (unknown) text += formatted("{} runs do not count here, because the error of their start is not known\n", unknown);
  return text;
}

}  // namespace

std::string table_text(const Experiment& experiment, const Answer& answer) {
  std::string text = overview(experiment, answer);
  for (std::size_t m = 0; m < experiment.metrics.size(); ++m) text += figure_table(experiment, answer, m);
  text += verdict_table(experiment, answer) + capture_text(experiment, answer) + "\n* the baseline";
  if (experiment.variants.size() > 1)
    text += formatted("; against it, with Holm's correction over all {}:",
                      answer.pairs.empty() ? answer.findings.size() : answer.pairs.size());
  text += "\n";
  for (const Finding& finding : answer.findings) text += "  " + printable(finding.sentence) + "\n";
  text += pairs_text(experiment, answer) + effects_text(experiment, answer);
  if (answer.look) {
    text += "\n" + printable(answer.look_sentence) + "\n";
    if (answer.look->number > 1) text += "The other intervals and p do not count the looks.\n";
  }
  return text;
}

}  // namespace marrow::cli
