// SPDX-License-Identifier: Apache-2.0
// What the files of a run's folder give a report. Files are told apart by what they say of themselves.
#include <fstream>
#include <sstream>
#include <thread>

#include "marrow/domain/error.hpp"
#include "marrow/runtime/hash.hpp"
#include "report/report.hpp"

namespace marrow::cli {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;

constexpr int kPictureSize = 1000;

std::string text_of_file(const fs::path& file) {
  std::ostringstream text;
  text << std::ifstream(file, std::ios::binary).rdbuf();
  return text.str();
}

std::string id_of(const std::string& content) {
  Hasher hasher;
  hasher.add(content);
  return hasher.digest().hex().substr(0, 16);
}

/// The rows "  - [evaluations, cost]" below "convergence:" in a pose's file.
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

json landscape_of(const json& file) {
  json profiles = json::array();
  for (json profile : file.at("profiles")) profiles.push_back(profile);
  return profiles;
}

}  // namespace

void ReportMaterial::add_run(const fs::path& run_folder, json& cell) {
  const json record = json::parse(text_of_file(run_folder / "run.json"), nullptr, false);
  if (!record.is_object() || !record.contains("outputs")) return;
  const auto add_json = [&](const json& file) {
    if (file.contains("marrow-landscape") && !cell.contains("landscape")) cell["landscape"] = landscape_of(file);
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
      view["image"] = id_of(image);
      pictures[id_of(image)] = image;
    }
    const std::string id = id_of(scene.dump());
    scenes[id] = std::move(scene);
    cell["scene"] = id;
  };
  for (const json& output : record["outputs"])
    for (const json& file : output.value("files", json::array())) {
      const fs::path path = run_folder / file.get<std::string>();
      const std::string extension = path.extension().string();
      try {
        if (extension == ".png") {
          const std::string url = picture_url(path, kPictureSize), id = id_of(url);
          pictures[id] = url;
          cell["pictures"].push_back({{"name", fs::path(file.get<std::string>()).lexically_relative("outputs").replace_extension().string()}, {"picture", id}});
        } else if (extension == ".json") {
          add_json(json::parse(text_of_file(path)));
        } else if (extension == ".yaml" && !cell.contains("convergence")) {
          const json steps = convergence_of(text_of_file(path));
          if (!steps.empty()) cell["convergence"] = steps;
        }
      } catch (const std::exception&) {  // a picture of 16 bits as TIFF, a damaged file: the report shows the others
      }
    }
}

void ReportMaterial::prepare(const fs::path& run_folder) {
  ReportMaterial material;
  json cell = json::object();
  material.add_run(run_folder, cell);
  std::ofstream(run_folder / "report.json") << json{{"cell", cell}, {"pictures", material.pictures}, {"geometries", material.geometries}, {"scenes", material.scenes}};
}

void ReportMaterial::add_prepared(const fs::path& run_folder, json& cell) {
  const json prepared = json::parse(text_of_file(run_folder / "report.json"), nullptr, false);
  if (!prepared.is_object()) return add_run(run_folder, cell);
  cell.update(prepared.at("cell"));
  pictures.update(prepared.at("pictures"));
  geometries.update(prepared.at("geometries"));
  scenes.update(prepared.at("scenes"));
}

json machine_of(const json& run_record) {
  std::string cpu;
  std::ifstream info("/proc/cpuinfo");
  for (std::string line; cpu.empty() && std::getline(info, line);)
    if (line.starts_with("model name")) cpu = line.substr(line.find(':') + 2);
  return {{"cpu", cpu}, {"cores", std::thread::hardware_concurrency()}, {"cpu_level", run_record.value("cpu_level", "")}};
}

}  // namespace marrow::cli
