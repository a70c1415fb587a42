// SPDX-License-Identifier: Apache-2.0
#include "curves/curve_files.hpp"

#include <cmath>
#include <set>

#include "commands.hpp"
#include "compare/csv.hpp"
#include "marrow/base/error.hpp"
#include "marrow/base/json_text.hpp"
#include "marrow/base/number_text.hpp"
#include "marrow/base/text_file.hpp"
#include "report/recipes.hpp"
#include "report/report.hpp"

namespace marrow::cli {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;

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

}  // namespace

json json_of(const CurveAnswer& answer) {
  return {{"sequences", list_of(answer.sequences)}, {"trials", list_of(answer.trials)}};
}

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
