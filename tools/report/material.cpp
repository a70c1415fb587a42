// SPDX-License-Identifier: Apache-2.0
// Collects the data of a report from the files of a run's folder. The content of a JSON or YAML file tells its kind.
#include <algorithm>
#include <cstdio>
#include <fstream>
#include <sstream>
#include <thread>

#include "compare/text_table.hpp"
#include "marrow/base/json_text.hpp"
#include "marrow/base/number_text.hpp"
#include "marrow/base/printable.hpp"
#include "marrow/runtime/run/verdicts.hpp"
#include "marrow/toolbox/files/yaml_values.hpp"
#include "report/report.hpp"
#include "run_files.hpp"

namespace marrow::cli {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;

constexpr int kPictureSize = 1000;

std::string id_of(const std::string& content) { return hash_of(content).hex().substr(0, 16); }

/// A file's name below outputs/, without its extension.
std::string place_of(const std::string& name) {
  return fs::path(name).lexically_relative("outputs").replace_extension().string();
}

/// The pose in a file. Throws Error for a file of another kind.
json pose_of(const fs::path& path, const std::string& name) {
  const Pose pose = files::read_pose_file(path);
  const RigidTransform& t = pose.world_from_model;
  json matrix = json::array(), deviations;
  for (int row = 0; row < 3; ++row) {
    for (int column = 0; column < 3; ++column) matrix.push_back(t.rotation(row, column));
    matrix.push_back(t.translation_mm[row]);
  }
  for (const double last : {0, 0, 0, 1}) matrix.push_back(last);
  if (pose.covariance) {
    const Vector6d deviation = pose.covariance->diagonal().cwiseSqrt();
    for (int i = 0; i < 6; ++i) deviations.push_back(i < 3 ? degrees(deviation[i]) : deviation[i]);
  }
  return {{"name", place_of(name)}, {"target", t.target},       {"source", t.source},
          {"matrix", matrix},       {"deviations", deviations}, {"has_bone_axes", pose.frame.is_anatomical}};
}

/// The rows "  - [evaluations, cost]" below "convergence:" in a pose file.
json convergence_of(const std::string& pose) {
  json steps = json::array();
  std::istringstream lines(pose.substr(std::min(pose.size(), pose.find("\nconvergence:"))));
  for (std::string line; std::getline(lines, line);) {
    int evaluations = 0;
    double cost = 0;
    if (std::sscanf(line.c_str(), " - [%d, %lf]", &evaluations, &cost) == 2) steps.push_back({evaluations, cost});
  }
  return steps;
}

/// The motion of a bone from the table of a trajectory, by the names of its columns. Throws for another table.
json trajectory_of(const std::string& text, const std::string& name) {
  static const std::vector<std::string> kAxes{"frontal_deg", "lateral_deg", "axial_deg",
                                              "frontal_mm",  "lateral_mm",  "along_mm"};
  std::istringstream lines(text);
  std::string line;
  std::getline(lines, line);
  const std::vector<std::string> header = csv_cells(line);
  const auto column = [&](const std::string& title) {
    const auto at = std::find(header.begin(), header.end(), title);
    if (at == header.end()) throw Error(name + ": has no column '" + title + "'");
    return std::size_t(at - header.begin());
  };
  json way = {{"name", place_of(name)}};
  while (std::getline(lines, line)) {
    const std::vector<std::string> cells = csv_cells(line);
    const auto number = [&](const std::string& title) { return parsed_number(cells.at(column(title))).value(); };
    json motion = json::array(), deviation = json::array();
    for (const std::string& axis : kAxes) {
      motion.push_back(number(axis));
      deviation.push_back(number("deviation_" + axis));
    }
    json matrix = json::array();
    for (const char row : {'1', '2', '3'})
      for (const std::string end : {"1", "2", "3", "4_mm"}) matrix.push_back(number(std::string("m") + row + end));
    for (const double last : {0, 0, 0, 1}) matrix.push_back(last);
    way["world_from_model"].push_back(matrix);
    way["frames"].push_back(cells.at(column("name")));
    way["time_s"].push_back(number("time_s"));
    way["found"].push_back(cells.at(column("found")) == "1");
    way["motion"].push_back(motion);
    way["deviation"].push_back(deviation);
  }
  return way;
}

/// The files that a run's record names.
std::vector<std::string> files_in(const json& record) {
  std::vector<std::string> files;
  for (const json& output : record.value("outputs", json::array()))
    for (const json& file : output.value("files", json::array())) files.push_back(file);
  return files;
}

}  // namespace

std::array<std::pair<const char*, json*>, 3> ReportMaterial::groups() {
  return {{{"pictures", &pictures}, {"geometries", &geometries}, {"scenes", &scenes}}};
}

void ReportMaterial::add_json(const json& file, json& cell) {
  if (file.contains("marrow-landscape") && !cell.contains("landscape")) cell["landscape"] = file.at("profiles");
  if (!file.contains("marrow-scene")) return;
  json scene = file;
  for (json& mesh : scene["meshes"]) {
    json geometry = {{"vertices", mesh["vertices"]}, {"triangles", mesh["triangles"]}};
    const std::string id = id_of(geometry.dump());
    geometries[id] = std::move(geometry);
    mesh = {{"name", mesh["name"]}, {"geometry", id}};
  }
  for (json& view : scene["views"]) {
    const std::string image = view["image"];
    if (!image.starts_with("data:image/"))
      throw Error("an image of the scene is not in the file itself");  // a browser would load anything from an address
    view["image"] = id_of(image);
    pictures[id_of(image)] = image;
  }
  const std::string id = id_of(scene.dump());
  scenes[id] = std::move(scene);
  cell["scene"] = id;
}

void ReportMaterial::add_file(const fs::path& path, const std::string& name, json& cell) {
  const std::string extension = path.extension().string();
  if (extension == ".png") {
    const std::string url = picture_url(path, kPictureSize), id = id_of(url);
    pictures[id] = url;
    cell["pictures"].push_back({{"name", place_of(name)}, {"picture", id}});
  } else if (extension == ".json") {
    add_json(parse_json(read_text_file(path, kMostRecordBytes), name), cell);
  } else if (extension == ".csv") {
    cell["trajectories"].push_back(trajectory_of(read_text_file(path, kMostRecordBytes), name));
  } else if (extension == ".yaml") {
    if (!cell.contains("convergence"))
      if (const json steps = convergence_of(read_text_file(path, kMostRecordBytes)); !steps.empty())
        cell["convergence"] = steps;
    cell["poses"].push_back(pose_of(path, name));
  }
}

void ReportMaterial::add_run(const fs::path& run_folder, json& cell) {
  std::vector<std::string> names;
  try {
    const json record = read_record(run_folder);
    names = files_in(record);
    for (const NamedVerdict& one : verdicts_in(record)) cell["verdicts"].push_back(json_of(one));
  } catch (const std::exception&) {  // the run was stopped, or its record is damaged
  }
  for (const std::string& name : names) {
    const auto path = file_of_run(run_folder, name);
    if (!path) note_if_outside(run_folder, name);
    try {
      if (path) add_file(*path, name, cell);
    } catch (const std::exception&) {  // for example a damaged file; the report shows the others
    }
  }
}

void ReportMaterial::note_if_outside(const fs::path& run_folder, const std::string& name) {
  if (leads_outside(run_folder, name))
    left_out.push_back(name + " is not shown: it lies outside the run's folder " + run_folder.string());
}

void ReportMaterial::print_left_out() const {
  for (const std::string& line : left_out) std::fprintf(stderr, "marrow: warning: %s\n", printable(line).c_str());
}

void ReportMaterial::prepare(const fs::path& run_folder) {
  ReportMaterial material;
  json cell = json::object();
  material.add_run(run_folder, cell);
  json all = {{"cell", std::move(cell)}, {"left_out", material.left_out}};
  for (const auto& [name, group] : material.groups()) all[name] = std::move(*group);
  write_text_file(run_folder / "report.json", json_text(all));
}

void ReportMaterial::add_prepared(const fs::path& run_folder, json& cell) {
  json prepared;
  try {
    const auto file = file_of_run(run_folder, "report.json");
    if (!file) throw Error("not there");
    prepared = parse_json(read_text_file(*file, kMostRecordBytes), "report.json");
    bool is_good = prepared.at("cell").is_object();
    for (const auto& [name, group] : groups()) is_good = prepared.at(name).is_object() && is_good;
    if (!is_good) throw Error("damaged");
  } catch (const std::exception&) {  // not there, or damaged
    return add_run(run_folder, cell);
  }
  cell.update(prepared["cell"]);
  for (const auto& [name, group] : groups()) group->update(prepared[name]);
  for (const std::string line : prepared.value("left_out", json::array())) left_out.push_back(line);
}

json machine_of(const json& run_record) {
  std::string cpu;
  std::ifstream info("/proc/cpuinfo");
  for (std::string line; cpu.empty() && std::getline(info, line);)
    if (line.starts_with("model name")) cpu = line.substr(line.find(':') + 2);
  return {
      {"cpu", cpu}, {"cores", std::thread::hardware_concurrency()}, {"cpu_level", run_record.value("cpu_level", "")}};
}

json plugins_of(const json& run_record) {
  json plugins = json::array();
  for (const json& plugin : run_record.value("plugins", json::array()))
    plugins.push_back({{"file", plugin.value("file", "")}, {"build_id", plugin.value("build_id", "")}});
  return plugins;
}

std::string text_if_readable(const fs::path& file) {
  try {
    return read_text_file(file, kMostSourceBytes);
  } catch (const Error&) {
    return "";
  }
}

}  // namespace marrow::cli
