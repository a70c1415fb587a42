// SPDX-License-Identifier: Apache-2.0
// The answer of a comparison as tables for the terminal.
//
// All pairs, the rankings and the effects of factors for the terminal.
#include <algorithm>
#include <cmath>
#include <limits>

#include "compare/comparison.hpp"
#include "compare/text_table.hpp"
#include "marrow/base/number_text.hpp"
#include "marrow/base/printable.hpp"
#include "marrow/runtime/pipeline/pipeline_names.hpp"

namespace marrow::cli {
namespace {

using compare::Experiment;

constexpr double kLargestFixed = 1e7, kSmallestFixed = 1e-5;

int power_of_ten(double value) { return int(std::floor(std::log10(value))); }

/// The number of characters: all bytes but those that continue one.
std::size_t characters_in(const std::string& text) {
  return std::size_t(std::count_if(text.begin(), text.end(), [](unsigned char byte) { return (byte & 0xC0) != 0x80; }));
}

constexpr std::size_t kMostPairs = 200;  // sentences of pairs; all are in comparison.json

std::string names_text(const Experiment& experiment, const std::vector<std::size_t>& variants) {
  std::vector<std::string> names;
  for (const std::size_t variant : variants) names.push_back(experiment.variants[variant].name);
  return joined(names, ", ");
}

std::string metric_title(const Experiment& experiment, const Answer& answer, std::size_t m) {
  return experiment.metrics[m].label + (answer.units[m].empty() ? "" : " [" + answer.units[m] + "]");
}

/// The pairs without the baseline, whose sentences stand above. Those that differ come first.
std::string sentences_of_pairs(const Experiment& experiment, const Answer& answer) {
  std::vector<const Finding*> others;
  for (const auto& [finding, reference] : answer.pairs)
    if (reference != experiment.baseline) others.push_back(&finding);
  if (others.empty()) return "";
  std::stable_partition(others.begin(), others.end(),
                        [](const Finding* one) { return compare::difference_shown(one->comparison, one->p_holm); });
  std::string text = "\nThe other pairs, in the same correction; those that differ come first\n";
  for (std::size_t i = 0; i < std::min(others.size(), kMostPairs); ++i)
    text += "  " + printable(others[i]->sentence) + "\n";
  if (others.size() > kMostPairs) text += formatted("  and {} more, in comparison.json\n", others.size() - kMostPairs);
  return text;
}

std::string ranking_text(const Experiment& experiment, const Answer& answer, std::size_t m) {
  const Ranking& ranking = answer.rankings[m];
  std::vector<double> medians;
  for (const Ranking::Place& place : ranking.places) medians.push_back(place.median);
  const NumberScale scale(medians);
  const bool has_groups = ranking.places.empty() || !ranking.places[0].group.empty();
  using enum Side;
  TextTable table({right, left, right, right, left});
  table.add({"", "", "median", "lost", "groups"});
  for (const Ranking::Place& place : ranking.places)
    table.add({formatted("{}", place.rank), experiment.variants[place.variant].name,
               std::isfinite(place.median) ? scale.text(place.median) : "a failure", formatted("{}", place.lost),
               has_groups ? place.group : "-"});
  return "\nRanking by " + printable(metric_title(experiment, answer, m)) +
         "; a lost run counts as worse than any other; no test tells apart those that share a letter\n" + table.text() +
         printable(ranking_sentence(experiment, answer, m)) + "\n";
}

/// The pairs, the rankings and the effects for the terminal; empty without any.
std::string pairs_text(const Experiment& experiment, const Answer& answer) {
  std::string text = sentences_of_pairs(experiment, answer);
  for (std::size_t m = 0; m < answer.rankings.size(); ++m) text += ranking_text(experiment, answer, m);
  return text;
}

std::string effects_text(const Experiment& experiment, const Answer& answer) {
  std::string text;
  const Effect* before = nullptr;
  for (const Effect& effect : answer.effects) {
    if (!before || before->metric != effect.metric)
      text += "\nWhat each factor does to " + printable(metric_title(experiment, answer, effect.metric)) +
              ", averaged over the others; each interval by itself\n";
    text += "  " + printable(experiment.factors[effect.factor].name + ": " + effect.sentence) + "\n";
    before = &effect;
  }
  return text;
}

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

NumberScale::NumberScale(const std::vector<double>& values) {
  double largest = 0, smallest = std::numeric_limits<double>::infinity();
  for (const double value : values) {
    const double size = std::abs(value);
    if (!std::isfinite(size) || size == 0) continue;
    largest = std::max(largest, size);
    smallest = std::min(smallest, size);
  }
  if (largest == 0) return;
  has_exponents_ = largest >= kLargestFixed || largest < kSmallestFixed;
  if (has_exponents_) return;
  const int of_largest = power_of_ten(largest), of_smallest = power_of_ten(smallest);
  const int wanted = of_largest < 0 ? 3 - of_largest : of_largest < 2 ? 4 : std::max(0, 5 - of_largest);
  decimals_ = std::clamp(2 - of_smallest, wanted, wanted + 3);  // three digits of the smallest, if that is not too many
}

std::string NumberScale::text(double value) const {
  if (value == 0) return fixed_number(0, has_exponents_ ? 0 : decimals_);
  const bool is_too_small = std::abs(value) < 10 * std::pow(10.0, -decimals_);
  return has_exponents_ || is_too_small ? formatted("{:.3e}", value) : formatted("{:.{}f}", value, decimals_);
}

std::string rate_text(std::size_t count, std::size_t of, const compare::Interval& interval, int decimals) {
  if (!of) return "-";
  return formatted("{}/{} ({} to {} %)", count, of, percent_text(interval.lower, decimals),
                   percent_text(interval.upper, decimals));
}

void TextTable::add(const std::vector<std::string>& row) {
  rows_.emplace_back();
  for (const std::string& text : row) rows_.back().push_back(printable(text));
}

std::string TextTable::text() const {
  std::vector<std::size_t> widths(columns_.size());
  for (const auto& row : rows_)
    for (std::size_t c = 0; c < row.size(); ++c) widths[c] = std::max(widths[c], characters_in(row[c]));
  std::string text;
  for (const auto& row : rows_) {
    std::string line;
    for (std::size_t c = 0; c < row.size(); ++c) {
      const std::string blanks(widths[c] - characters_in(row[c]), ' ');
      line += (c ? "  " : "") + (columns_[c] == Side::right ? blanks + row[c] : row[c] + blanks);
    }
    line.erase(line.find_last_not_of(' ') + 1);
    text += line + "\n";
  }
  return text;
}

std::string csv_field(const std::string& raw) {
  std::string text;
  for (std::size_t begin = 0, end = 0; begin <= raw.size(); begin = end + 1) {
    end = std::min(raw.find('\n', begin), raw.size());
    text += (begin ? "\n" : "") + printable(raw.substr(begin, end - begin));
  }
  if (!text.empty() && std::string("=+-@\t\r\n").find(text[0]) != std::string::npos && !parsed_number(text))
    text = "'" + text;
  if (text.find_first_of(",\"\n\r") == std::string::npos) return text;
  std::string quoted = "\"";
  for (char c : text) quoted += c == '"' ? "\"\"" : std::string(1, c);
  return quoted + "\"";
}

std::string csv_number(const std::optional<double>& value) {
  if (!value) return "";
  return formatted("{:.9g}", *value);
}

std::vector<std::string> csv_cells(const std::string& line) {
  std::vector<std::string> cells(1);
  bool quoted = false;
  for (std::size_t i = 0; i < line.size(); ++i) {
    const char c = line[i];
    if (c == '"' && quoted && i + 1 < line.size() && line[i + 1] == '"')
      cells.back() += line[i++];
    else if (c == '"')
      quoted = !quoted;
    else if (c == ',' && !quoted)
      cells.emplace_back();
    else if (c != '\r')
      cells.back() += c;
  }
  return cells;
}

std::string ranking_sentence(const Experiment& experiment, const Answer& answer, std::size_t m) {
  const Ranking& ranking = answer.rankings[m];
  std::string text =
      "best in " + experiment.metrics[m].label + ": " + experiment.variants[ranking.places.front().variant].name;
  text += formatted("; {} of {} pairs differ", ranking.different, ranking.pairs);
  if (!ranking.better_than_best.empty())
    text += "; shown to be better than it, compared case by case: " + names_text(experiment, ranking.better_than_best);
  text += "; not told apart from it: " +
          (ranking.like_best.empty() ? std::string("none") : names_text(experiment, ranking.like_best));
  return text;
}

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
