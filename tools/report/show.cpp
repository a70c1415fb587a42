// SPDX-License-Identifier: Apache-2.0
#include <cstdio>
#include <optional>

#include "command_options.hpp"
#include "marrow/base/file_names.hpp"
#include "marrow/base/json_text.hpp"
#include "marrow/base/printable.hpp"
#include "report/report.hpp"
#include "run_files.hpp"

namespace marrow::cli {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;

/// The figures of merit in a file. Nothing for files of another kind.
std::optional<json> metrics_in(const fs::path& folder, const std::string& name) {
  const auto path = file_of_run(folder, name);
  if (!path || path->extension() != ".json") return std::nullopt;
  try {
    const json file = parse_json(read_text_file(*path, kMostRecordBytes), name);
    json metrics = json::array();
    for (const json& metric : file.at("metrics"))
      metrics.push_back({{"name", metric.at("name").get<std::string>()},
                         {"unit", metric.value("unit", "")},
                         {"value", metric.contains("value") ? metric["value"] : json()}});
    return metrics;
  } catch (const std::exception&) {  // of another kind, or damaged
    return std::nullopt;
  }
}

}  // namespace

json figures_of(const fs::path& folder, const json& record) {
  json tables = json::array();
  for (const json& output : record.value("outputs", json::array()))
    for (const json& file : output.value("files", json::array())) {
      const fs::path path = file.get<std::string>();
      const auto metrics = metrics_in(folder, path.string());
      if (!metrics) continue;
      const std::string name = path.parent_path().lexically_relative("outputs").string();
      if (tables.empty() || tables.back()["name"] != name)
        tables.push_back({{"name", name}, {"columns", json::array()}, {"rows", json::array()}});
      json& table = tables.back();
      table["columns"].push_back(path.stem().string());
      for (const json& metric : *metrics) {
        json* row = nullptr;
        for (json& one : table["rows"])
          if (one["name"] == metric["name"]) row = &one;
        if (!row) {
          table["rows"].push_back({{"name", metric["name"]}, {"unit", metric["unit"]}, {"values", json::array()}});
          row = &table["rows"].back();
        }
        while ((*row)["values"].size() + 1 < table["columns"].size()) (*row)["values"].push_back(nullptr);
        (*row)["values"].push_back(metric["value"]);
      }
    }
  return tables;
}

namespace {

/// The passes of the nodes that have bodies.
json passes_of(const json& record) {
  json all = json::array();
  for (const json& node : record.value("nodes", json::array())) {
    if (!node.contains("passes")) continue;
    json passes = json::array();
    for (const json& pass : node["passes"])
      passes.push_back({{"name", pass.at("name").get<std::string>()},
                        {"status", pass.at("status").get<std::string>()},
                        {"seconds", pass.value("seconds", 0.0)},
                        {"reason", pass.value("reason", "")}});
    all.push_back({{"node", node.value("id", "")}, {"end", node.value("end", "")}, {"passes", passes}});
  }
  return all;
}

json graph_of_run(const fs::path& file) {
  const Catalogue catalogue;
  Diagnostics diagnostics;
  const Pipeline pipeline = read_pipeline(file, {}, catalogue, diagnostics);
  return diagnostics.empty() ? graph_of(pipeline, {}) : json();  // for example, a plugin no longer exists
}

std::string failure_of(const json& node) {
  return "node '" + node.value("id", "") + "' (" + node.value("uses", "") + ") failed: " + node.value("reason", "");
}

std::string reason_of(const json& record) {
  for (const json& node : record.value("nodes", json::array()))
    if (node.value("status", "") == "failed") {
      const int stopped = node.value("not_run_because_of_it", 0);
      return failure_of(node) + (stopped > 0 ? "\n" + not_run_text(stopped) : "");
    }
  return "it was stopped before it was done";
}

/// A line for each node that failed but may fail: the run continued without it.
std::string absent_of(const json& record) {
  std::string text;
  for (const json& node : record.value("nodes", json::array()))
    if (node.value("status", "") == status_name(NodeRecord::Status::failed_alone))
      text += (text.empty() ? "" : "\n") + failure_of(node);
  return text;
}

/// Nothing if the record is damaged or old: the page shows what it can.
std::vector<NamedRecipe> recipes_of(const fs::path& folder) {
  try {
    return {{"", recipe_of_folder(folder)}};
  } catch (const std::exception&) {
    return {};
  }
}

json page_of(const fs::path& folder, const json& record, ReportMaterial& material) {
  const std::string run_name = fs::absolute(folder / ".").parent_path().filename().string();
  json cell = {{"id", run_name},
               {"variant", 0},
               {"case", 0},
               {"start", 0},
               {"tries", 1},
               {"values", json::array()},
               {"seconds", record.value("seconds", 0.0)},
               {"status", record.value("status", "") == "done" ? "done" : "failed"},
               {"success", nullptr},
               {"folder", plain_path(fs::absolute(folder)).string()}};
  if (cell["status"] == "failed") cell["reason"] = reason_of(record);
  if (const std::string absent = absent_of(record); !absent.empty()) cell["absent"] = absent;
  json data = {{"marrow", record.value("marrow", "")},
               {"format", 1},
               {"kind", "run"},
               {"metrics", json::array()},
               {"cases", {run_name}},
               {"starts", {"0"}},
               {"variants", {{{"name", "result"}, {"is_baseline", false}, {"options", json::object()}}}}};
  data["figures"] = figures_of(folder, record);
  data["passes"] = passes_of(record);
  if (json profile = profile_of(folder, material.left_out); !profile.is_null()) data["profile"] = std::move(profile);
  material.add_run(folder, cell);
  data["cells"] = {cell};
  for (const auto& [name, group] : material.groups()) data[name] = std::move(*group);
  const auto pipeline = file_of_run(folder, "pipeline.yaml");
  if (!pipeline) material.note_if_outside(folder, "pipeline.yaml");
  const json graph = pipeline ? graph_of_run(*pipeline) : json();
  if (graph.is_object()) data["graph"] = graph;
  data["experiment"] = {{"name", record.value("pipeline", run_name)},
                        {"pipeline_text", pipeline ? text_if_readable(*pipeline) : ""},
                        {"seed", record.contains("seed") ? record["seed"] : json(1)},
                        {"finished", record.value("finished", "")},
                        {"command", "marrow rerun " + shell_path(folder)},
                        {"folder", cell["folder"]},
                        {"machine", machine_of(record)},
                        {"plugins", plugins_of(record)}};
  return data;
}

}  // namespace

fs::path write_run_page(const fs::path& folder, fs::path file) {
  expect_given(folder, Wanted::run);
  std::error_code error;
  if (!fs::exists(folder / "run.json", error))
    throw Error(folder.string() +
                " is not the folder of a run: it has no run.json; give the folder that marrow run wrote");
  const json record = read_record(folder);
  if (!record.contains("nodes") || !record.contains("status"))
    refuse_record(folder, "what it should say is missing in it, or of another type");
  const Kinds kinds = file.empty() ? Kinds::files : Kinds::files_and_pipes;
  if (file.empty()) file = folder / "report.html";
  ReportMaterial material;
  try {
    write_page(page_of(folder, record, material), recipes_of(folder), file, kinds);
  } catch (const json::exception&) {
    refuse_record(folder, "what it should say is missing in it, or of another type");
  }
  material.print_left_out();
  return file;
}

void add_show(CLI::App& app, int& code) {
  const auto run = std::make_shared<fs::path>(), file = std::make_shared<fs::path>();
  const auto inputs = std::make_shared<std::vector<std::string>>();
  const auto resolved = std::make_shared<bool>(false);
  CLI::App* command = app.add_subcommand("show", "write a page that shows a run: figures, pictures, 3D view");
  command->add_option("run", *run, "folder of the run; with --resolved, a pipeline file")
      ->required()
      ->type_name("FOLDER");
  command->add_option("inputs", *inputs, "with --resolved: values of the pipeline's inputs, as name=value");
  command->add_option("-o,--out", *file, "HTML file to write; an existing one is replaced (default: RUN/report.html)")
      ->type_name("FILE");
  command->add_flag("--resolved", *resolved,
                    "print a pipeline file whole: with what it extends, its parts, and all options, and where each is "
                    "written");
  command->callback([run, file, inputs, resolved, &code] {
    if (*resolved) {
      code = print_resolved({*run, *inputs, {}, {}});
      return;
    }
    if (!inputs->empty()) throw Error("values of inputs are for --resolved; the page of a run takes none");
    std::printf("%s\n", printable(plain_path(fs::absolute(write_run_page(*run, *file))).string()).c_str());
    code = 0;
  });
}

}  // namespace marrow::cli
