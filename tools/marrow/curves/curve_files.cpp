// SPDX-License-Identifier: Apache-2.0
// A comparison over time for the terminal: one table and one sentence for each figure.
#include "curves/curves.hpp"

#include <cmath>
#include <cstdio>
#include <set>

#include "commands.hpp"
#include "compare/text_table.hpp"
#include "marrow/base/json_text.hpp"
#include "marrow/base/number_text.hpp"
#include "marrow/base/printable.hpp"
#include "report/report.hpp"

namespace marrow::cli {
namespace {

using compare::Interval;
namespace fs = std::filesystem;
using nlohmann::json;

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

json number_json(double value) { return std::isfinite(value) ? json(value) : json(); }

json list_json(const std::vector<double>& values) {
  json list = json::array();
  for (const double value : values) list.push_back(number_json(value));
  return list;
}

template <class T>
json optional_json(const std::optional<T>& value) {
  return value ? json(*value) : json();
}

json range_json(const std::optional<compare::Interval>& range) {
  return range ? json{range->lower, range->upper} : json();
}

json json_of(const ComparedFigure& figure) {
  using Interpolated = compare::PairedCurves::Interpolated;
  const compare::CurveDifference& d = figure.difference;
  const Interpolated how = figure.pair.interpolated;
  return {{"name", figure.name},
          {"unit", figure.unit},
          {"time_unit", time_unit(figure.in_seconds)},
          {"interpolated", how == Interpolated::none ? json() : json(how == Interpolated::first ? "first" : "second")},
          {"at", figure.pair.at},
          {"first", list_json(figure.pair.first)},
          {"second", list_json(figure.pair.second)},
          {"difference", list_json(figure.pair.difference)},
          {"times", d.times},
          {"both", d.both},
          {"only_first", d.only_first},
          {"only_second", d.only_second},
          {"bias", d.bias},
          {"bias_interval", d.mean ? range_json(d.mean->interval) : json()},
          {"freedom", d.mean ? json(d.mean->freedom) : json()},
          {"effective_frames", d.mean ? json(d.mean->effective_frames) : json()},
          {"rms", d.rms},
          {"largest", d.largest},
          {"largest_at", d.largest_at},
          {"deviation", optional_json(d.deviation)},
          {"agreement", range_json(d.agreement)},
          {"correlation", optional_json(d.correlation)},
          {"lag", d.lag ? json(d.lag->lag) : json()},
          {"lag_correlation", d.lag ? json(d.lag->correlation) : json()},
          {"sentence", sentence_of(figure)}};
}

json json_of(const TrialFigure& figure) {
  json curves = json::array();
  for (std::size_t i = 0; i < figure.trials.size(); ++i)
    curves.push_back({{"trial", figure.trials[i]}, {"difference", figure.differences[i]}});
  json outside = json::array();
  for (const auto& [from, to] : figure.outside) outside.push_back({from, to});
  return {{"name", figure.name},
          {"unit", figure.unit},
          {"time_unit", time_unit(figure.in_seconds)},
          {"at", figure.at},
          {"curves", curves},
          {"bias", figure.bias},
          {"bias_interval", range_json(figure.interval)},
          {"mean", figure.band ? json(figure.band->mean) : json()},
          {"pointwise", figure.band ? json(figure.band->pointwise) : json()},
          {"simultaneous", figure.band ? json(figure.band->simultaneous) : json()},
          {"outside", outside},
          {"sentence", sentence_of(figure)}};
}

template <class Compared>
json list_of(const std::vector<Compared>& all) {
  json list = json::array();
  for (const Compared& one : all) {
    json figures = json::array();
    for (const auto& figure : one.figures) figures.push_back(json_of(figure));
    list.push_back({{"first", one.first}, {"second", one.second}, {"figures", figures}, {"notes", one.notes}});
  }
  return list;
}

std::string number_cell(double value) { return std::isfinite(value) ? exact_number(value) : ""; }

json page_of(const json& answer) {
  return {{"marrow", version_text()},
          {"format", 1},
          {"kind", "over_time"},
          {"experiment", {{"name", "Sequences compared over time"}}},
          {"over_time", answer}};
}

/// Of the runs that were compared; a file or a folder of files has none.
std::vector<NamedRecipe> recipes_of(const CurveAnswer& answer) {
  std::vector<NamedRecipe> recipes;
  std::set<std::string> known;
  for (const ComparedSequences& one : answer.sequences)
    for (const std::string& run : {one.first, one.second}) try {
        if (fs::exists(fs::path(run) / "run.json") && known.insert(run).second)
          recipes.push_back({run, recipe_of_folder(run)});
      } catch (const Error&) {  // the record is damaged; its sequences could still be read
      }
  return recipes;
}

/// A row for each figure and time of each comparison, and of trials for each trial.
std::string csv_of(const CurveAnswer& answer) {
  std::string text = "first_sequence,second_sequence,trial,figure,unit,time_unit,at,first,second,difference\n";
  const auto head = [](const auto& one, const std::string& trial, const auto& figure) {
    std::string row;
    for (const std::string& field : {one.first, one.second, trial, figure.name, figure.unit})
      row += csv_field(field) + ",";
    return row + time_unit(figure.in_seconds) + ",";
  };
  for (const ComparedSequences& one : answer.sequences)
    for (const ComparedFigure& figure : one.figures)
      for (std::size_t i = 0; i < figure.pair.at.size(); ++i)
        text += head(one, "", figure) + number_cell(figure.pair.at[i]) + "," + number_cell(figure.pair.first[i]) + "," +
                number_cell(figure.pair.second[i]) + "," + number_cell(figure.pair.difference[i]) + "\n";
  for (const ComparedTrials& one : answer.trials)
    for (const TrialFigure& figure : one.figures)
      for (std::size_t k = 0; k < figure.trials.size(); ++k)
        for (std::size_t i = 0; i < figure.at.size(); ++i)
          text += head(one, figure.trials[k], figure) + number_cell(figure.at[i]) + ",,," +
                  number_cell(figure.differences[k][i]) + "\n";
  return text;
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

json json_of(const CurveAnswer& answer) {
  return {{"sequences", list_of(answer.sequences)}, {"trials", list_of(answer.trials)}};
}

void write_curves(const CurveAnswer& answer, const fs::path& folder) {
  std::error_code error;
  if (fs::exists(folder, error) && (!fs::is_directory(folder, error) || !fs::is_empty(folder, error)))
    throw Error(folder.string() + " is not a new or empty folder; choose another with --out");
  fs::create_directories(folder, error);
  if (error) throw Error(folder.string() + ": the folder cannot be made: " + error.message());
  const json all = json_of(answer);
  write_text_file(folder / "curves.json", json_text(all, 1) + "\n");
  write_text_file(folder / "curves.csv", csv_of(answer));
  write_page(page_of(all), recipes_of(answer), folder / "report.html");
}

}  // namespace marrow::cli
