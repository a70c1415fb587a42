// SPDX-License-Identifier: Apache-2.0
// A comparison over time for the terminal: one table and one sentence for each figure.
#include <cmath>
#include <cstdio>

#include "compare/text_table.hpp"
#include "curves/curve_files.hpp"
#include "marrow/base/number_text.hpp"
#include "marrow/base/printable.hpp"

namespace marrow::cli {
namespace {

using compare::Interval;

std::string number_text(const std::optional<double>& value) { return value ? short_number(*value) : "-"; }

std::string range_text(const std::optional<Interval>& range) {
  return range ? short_number(range->lower) + " to " + short_number(range->upper) : "-";
}

std::string with_unit(double value, const std::string& unit) {
  return short_number(value) + (unit.empty() ? "" : " " + unit);
}

std::string at_text(double at, bool in_seconds) {
  return in_seconds ? short_number(at, 6) + " s" : "frame " + short_number(at, 6);
}

std::string bias_text(double bias, const std::string& unit) {
  if (bias == 0) return "the mean difference is 0";
  return "the second is " + with_unit(std::abs(bias), unit) + (bias > 0 ? " larger" : " smaller") + " on average";
}

/// Where the interval holds 0, what stands before the mean difference.
std::string not_shown(const Interval& interval) {
  return interval.lower <= 0 && interval.upper >= 0 ? "no difference shown on average: " : "";
}

std::string lag_text(const ComparedFigure& figure) {
  const auto& lag = figure.difference.lag;
  if (!lag) return "";
  if (std::abs(lag->lag) < 0.5 * figure.pair.step) return ", and no lag matches better";
  const std::string by =
      figure.in_seconds ? with_unit(std::abs(lag->lag), "s") : short_number(std::abs(lag->lag)) + " frames";
  return formatted(", and they match best with the second {} {} (correlation {})", by,
                   lag->lag > 0 ? "later" : "earlier", short_number(lag->correlation));
}

std::string outside_text(const TrialFigure& figure) {
  if (!figure.band) return formatted("; a band takes at least {} trials", compare::kFewestTrials);
  if (figure.outside.empty()) return "; the simultaneous band holds 0 at all times";
  std::string text;
  for (std::size_t i = 0; i < figure.outside.size() && i < 5; ++i)
    text +=
        (i ? ", " : "") + short_number(figure.outside[i].first, 6) + " to " + short_number(figure.outside[i].second, 6);
  return "; the simultaneous band is without 0 at " + std::string(figure.in_seconds ? "seconds " : "frames ") + text +
         (figure.outside.size() > 5 ? ", ..." : "");
}

void print_notes(const std::vector<std::string>& notes) {
  for (const std::string& note : notes) std::printf("note: %s\n", printable(note).c_str());
  if (!notes.empty()) std::printf("\n");
}

void print_pair(const std::string& first, const std::string& second) {
  std::printf("first: %s\nsecond: %s (differences are second - first)\n\n", printable(first).c_str(),
              printable(second).c_str());
}

void print_sequences(const ComparedSequences& one) {
  print_pair(one.first, one.second);
  std::vector<Side> columns(13, Side::right);
  columns[0] = columns[1] = Side::left;
  TextTable table(columns);
  table.add({"figure", "unit", "times", "both", "only first", "only second", "bias", "95 % interval", "RMS", "largest",
             "95 % of differences", "correlation", "lag"});
  for (const ComparedFigure& figure : one.figures) {
    const compare::CurveDifference& d = figure.difference;
    table.add({figure.name, figure.unit, formatted("{}", d.times), formatted("{}", d.both),
               percent_text(double(d.only_first) / double(d.times), 0) + " %",
               percent_text(double(d.only_second) / double(d.times), 0) + " %", short_number(d.bias),
               d.mean ? range_text(d.mean->interval) : "-", short_number(d.rms), short_number(d.largest),
               range_text(d.agreement), number_text(d.correlation),
               d.lag ? short_number(d.lag->lag) + (figure.in_seconds ? " s" : " frames") : "-"});
  }
  std::printf("%s\n", table.text().c_str());
  print_notes(one.notes);
  for (const ComparedFigure& figure : one.figures) std::printf("%s\n", printable(sentence_of(figure)).c_str());
  std::printf("\n");
}

void print_trials(const ComparedTrials& one) {
  print_pair(one.first, one.second);
  std::vector<Side> columns(6, Side::right);
  columns[0] = columns[1] = Side::left;
  TextTable table(columns);
  table.add({"figure", "unit", "trials", "times", "bias", "95 % interval"});
  for (const TrialFigure& figure : one.figures)
    table.add({figure.name, figure.unit, formatted("{}", figure.trials.size()), formatted("{}", figure.at.size()),
               short_number(figure.bias), range_text(figure.interval)});
  std::printf("%s\n", table.text().c_str());
  print_notes(one.notes);
  for (const TrialFigure& figure : one.figures) std::printf("%s\n", printable(sentence_of(figure)).c_str());
  std::printf("\n");
}

}  // namespace

std::string sentence_of(const ComparedFigure& figure) {
  const compare::CurveDifference& d = figure.difference;
  std::string text = figure.name + ": " + (d.mean ? not_shown(d.mean->interval) : "") + bias_text(d.bias, figure.unit);
  if (d.mean)
    text += formatted(", 95 % interval {}, as of {} independent frames", range_text(d.mean->interval),
                      short_number(d.mean->effective_frames));
  else
    text += ", without an interval";
  text += formatted("; the largest difference is {} at {}", with_unit(d.largest, figure.unit),
                    at_text(d.largest_at, figure.in_seconds));
  if (d.correlation) text += "; correlation " + short_number(*d.correlation) + lag_text(figure);
  return text;
}

std::string sentence_of(const TrialFigure& figure) {
  std::string text =
      figure.name + ": " + (figure.interval ? not_shown(*figure.interval) : "") + bias_text(figure.bias, figure.unit);
  if (figure.interval)
    text += formatted(", 95 % interval {}, {}", range_text(figure.interval), counted(figure.trials.size(), "trial"));
  return text + outside_text(figure);
}

void print(const CurveAnswer& answer) {
  for (const ComparedSequences& one : answer.sequences) print_sequences(one);
  for (const ComparedTrials& one : answer.trials) print_trials(one);
  if (!answer.sequences.empty())
    std::printf(
        "Successive frames are not independent: the interval of a mean comes from the slow waves of the difference "
        "(cosine weights, Student's t). There is none for fewer than 12 frames.\n");
  if (!answer.trials.empty())
    std::printf(
        "Trials are independent: intervals are Student's t over the trials, and the simultaneous band holds the whole "
        "mean difference in 95 %%.\n");
}

}  // namespace marrow::cli
