// SPDX-License-Identifier: Apache-2.0
// Nodes that make what a table says: figures, verdicts and poses whose values are known before a comparison runs, and
// cells that fail or crash where the table says so. A line of the table is
//
//     row,column,start,name,text
//
// `row` is a number (0 where a table is of one case), `column` the variant's, `start` the first part of the
// displacement. `text` is what a node makes of it: "1.25 mm", "nan", "absent" (the figure is not there), "fail",
// "crash"; "doubtful 7" for a verdict, whose percentage may be missing; the evaluations of a pose, from which its place
// and its predicted deviations follow.
#include <cstdlib>
#include <fstream>
#include <sstream>

#include <marrow/plugin.hpp>

namespace {

using marrow::Error, marrow::Metrics;

struct Options {
  std::filesystem::path table;
  int row = 0;
  std::string column, other;
  std::vector<std::string> names{"a"};
  double at = 0;
};

/// The texts of one cell, by their names.
using Texts = std::map<std::string, std::string>;

std::vector<std::string> parts_of(const std::string& line, char mark) {
  std::vector<std::string> parts;
  std::istringstream stream(line);
  for (std::string part; std::getline(stream, part, mark);) parts.push_back(part);
  return parts;
}

/// The lines of the row and column whose start is the nearest one.
Texts texts_of(const Options& options, double start) {
  const bool is_folder = std::filesystem::is_directory(options.table);
  std::ifstream stream(is_folder ? options.table / "figures.csv" : options.table);
  if (!stream) throw Error("there is no table at " + options.table.string());
  std::map<double, Texts> by_distance;
  for (std::string line; std::getline(stream, line);) {
    const std::vector<std::string> parts = parts_of(line, ',');
    if (parts.size() != 5) throw Error("a line of the table has not five parts: " + line);
    if (std::stoi(parts[0]) == options.row && parts[1] == options.column + options.other)
      by_distance[std::abs(std::stod(parts[2]) - start)][parts[3]] = parts[4];
  }
  if (by_distance.empty()) throw Error("the table has no column '" + options.column + "'");
  return by_distance.begin()->second;
}

double value_of(const Metrics& metrics) { return metrics.items.at(0).value; }

struct StartOptions {
  std::array<double, 3> rotation_deg{}, translation_mm{};
  double distance_mm = 0;
};
Metrics start(const StartOptions& options) { return {{{"x_mm", options.translation_mm[0], "mm"}}}; }

Metrics figures(const Metrics& start, const Options& options) {
  const Texts texts = texts_of(options, value_of(start));
  Metrics made;
  for (const std::string& name : options.names) {
    const std::string& text = texts.at(name);
    if (text == "crash") std::abort();
    if (text == "fail") throw Error("the table says so");
    if (text == "absent") continue;
    const std::vector<std::string> parts = parts_of(text, ' ');
    const double more = made.items.empty() ? options.at * options.at : 0;
    made.items.push_back({name, std::stod(parts.at(0)) + more, parts.size() > 1 ? parts[1] : ""});
  }
  return made;
}

marrow::Verdict verdict(const Metrics& start, const Options& options) {
  const std::vector<std::string> parts = parts_of(texts_of(options, value_of(start)).at("verdict"), ' ');
  marrow::Verdict verdict;
  verdict.judgement = marrow::judgement_named(parts.at(0)).value();
  if (parts.size() > 1) verdict.failure_probability = std::stod(parts[1]) / 100;
  return verdict;
}

marrow::Pose pose(const Metrics& start, const Options& options) {
  marrow::Pose pose;
  pose.evaluations = std::stoi(texts_of(options, value_of(start)).at("evaluations"));
  const double e = pose.evaluations;
  pose.world_from_model.translation_mm = {e, -0.5 * e, 0.25};
  if (pose.evaluations % 2) pose.world_from_model.rotation << 0, -1, 0, 1, 0, 0, 0, 0, 1;  // by 90 degrees about z
  if (pose.evaluations % 3) return pose;
  marrow::Vector6d deviations;
  for (int i = 0; i < 6; ++i) deviations[i] = 0.001 * (e + i);
  if (pose.evaluations % 6 == 0) deviations[5] = std::numeric_limits<double>::infinity();
  pose.covariance = marrow::Matrix6d(deviations.cwiseAbs2().asDiagonal());
  pose.frame.is_anatomical = pose.evaluations % 9 == 0;
  return pose;
}

void add_options(auto&& node) {
  node.option("table", &Options::table, "file, or folder with figures.csv")
      .option("row", &Options::row, "row of the table")
      .option("column", &Options::column, "column of the table");
}

}  // namespace

MARROW_PLUGIN(plugin) {
  plugin.node("test.given_start", start)
      .summary("A start")
      .out("start", "first part of its displacement")
      .option("rotation_deg", &StartOptions::rotation_deg, "rotation")
      .option("translation_mm", &StartOptions::translation_mm, "translation")
      .option("distance_mm", &StartOptions::distance_mm, "distance");
  add_options(plugin.node("test.given_figures", figures)
                  .summary("Figures that a table has")
                  .in("start", "which start")
                  .out("figures", "the figures")
                  .figures({"*"})
                  .option("names", &Options::names, "which figures")
                  .option("other", &Options::other, "the end of the column's name")
                  .option("at", &Options::at, "its square is added to the first figure"));
  add_options(plugin.node("test.given_verdict", verdict)
                  .summary("A verdict that a table has")
                  .in("start", "which start")
                  .out("verdict", "the verdict"));
  add_options(plugin.node("test.given_pose", pose)
                  .summary("A pose after so many evaluations")
                  .in("start", "which start")
                  .out("pose", "the pose"));
}
