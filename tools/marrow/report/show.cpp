// SPDX-License-Identifier: Apache-2.0
#include <cstdio>
#include <fstream>
#include <sstream>

#include "marrow/domain/error.hpp"
#include "report/report.hpp"

namespace marrow::cli {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;

std::string text_of_file(const fs::path& file) {
  std::ostringstream text;
  text << std::ifstream(file, std::ios::binary).rdbuf();
  return text.str();
}

/// "distal.final.mtre_mm" of outputs/errors/distal/final.json.
std::string figure_name(const std::string& file, const std::string& metric) {
  std::string name = fs::path(file).lexically_relative("outputs").replace_extension().string();
  std::replace(name.begin(), name.end(), '/', '.');
  return name + "." + metric;
}

/// The figures of merit that the run wrote become the cell's metrics.
void add_figures(const fs::path& folder, const json& record, json& metrics, json& cell) {
  for (const json& output : record.value("outputs", json::array()))
    for (const json& file : output.value("files", json::array())) {
      const std::string name = file;
      if (!name.ends_with(".json")) continue;
      const json figures = json::parse(text_of_file(folder / name), nullptr, false);
      if (!figures.is_object() || !figures.contains("metrics")) continue;
      for (const json& metric : figures["metrics"]) {
        const std::string label = figure_name(name, metric.value("name", ""));
        metrics.push_back({{"name", label}, {"label", label}, {"unit", metric.value("unit", "")}, {"success_below", nullptr}});
        cell["values"].push_back(metric["value"]);
      }
    }
}

json graph_of_run(const fs::path& folder) {
  const Catalogue catalogue;
  Diagnostics diagnostics;
  const Pipeline pipeline = read_pipeline(folder / "pipeline.yaml", {}, catalogue, diagnostics);
  return diagnostics.empty() ? graph_of(pipeline, {}) : json();  // a plugin that is no longer there
}

std::string reason_of(const json& record) {
  for (const json& node : record.value("nodes", json::array()))
    if (node.value("status", "") == "failed") return "node '" + node.value("id", "") + "' (" + node.value("uses", "") + ") failed: " + node.value("reason", "");
  return "it was stopped before it was done";
}

}  // namespace

int show(const fs::path& folder, fs::path file) {
  const json record = json::parse(text_of_file(folder / "run.json"), nullptr, false);
  if (!record.is_object() || !record.contains("nodes"))
    throw Error(folder.string() + " is not the folder of a run: it has no run.json that can be read; give the folder that marrow run wrote");
  if (file.empty()) file = folder / "report.html";
  const std::string name = fs::absolute(folder / ".").parent_path().filename().string();
  json cell = {{"id", name}, {"variant", 0}, {"case", 0}, {"start", 0}, {"tries", 1}, {"values", json::array()}, {"seconds", record.value("seconds", 0.0)},
               {"status", record.value("status", "") == "done" ? "done" : "failed"}, {"success", nullptr}, {"folder", fs::absolute(folder).lexically_normal().string()}};
  if (cell["status"] == "failed") cell["reason"] = reason_of(record);
  json data = {{"marrow", record.value("marrow", "")}, {"format", 1}, {"kind", "run"}, {"metrics", json::array()}, {"cases", {name}}, {"starts", {"0"}},
               {"variants", {{{"name", "result"}, {"is_baseline", false}, {"options", json::object()}}}}};
  add_figures(folder, record, data["metrics"], cell);
  ReportMaterial material;
  material.add_run(folder, cell);
  data["cells"] = {cell};
  data["pictures"] = std::move(material.pictures);
  data["geometries"] = std::move(material.geometries);
  data["scenes"] = std::move(material.scenes);
  const json graph = graph_of_run(folder);
  if (graph.is_object()) data["graph"] = graph;
  json plugins = json::array();
  for (const json& plugin : record.value("plugins", json::array())) plugins.push_back({{"file", plugin.value("file", "")}, {"build_id", plugin.value("build_id", "")}});
  data["experiment"] = {{"name", record.value("pipeline", name)}, {"pipeline_text", text_of_file(folder / "pipeline.yaml")}, {"seed", record.value("seed", 1)},
                        {"finished", record.value("finished", "")}, {"command", "marrow rerun " + folder.string()}, {"folder", cell["folder"]},
                        {"machine", machine_of(record)}, {"plugins", plugins}};
  write_page(data, file);
  std::printf("%s\n", fs::absolute(file).lexically_normal().c_str());
  return 0;
}

}  // namespace marrow::cli
