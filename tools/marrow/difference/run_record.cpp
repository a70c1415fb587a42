// SPDX-License-Identifier: Apache-2.0
#include "difference/run_record.hpp"

#include <yaml-cpp/yaml.h>

#include <algorithm>
#include <fstream>
#include <nlohmann/json.hpp>
#include <sstream>

#include "marrow/domain/error.hpp"

namespace marrow::cli {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;

std::string text_of_file(const fs::path& file) {
  std::ostringstream text;
  text << std::ifstream(file, std::ios::binary).rdbuf();
  return text.str();
}

/// A scalar as it is written, a list as [a, b].
std::string text_of(const YAML::Node& value) {
  if (!value.IsSequence()) return value.IsScalar() ? value.Scalar() : "";
  std::string text;
  for (const YAML::Node& item : value) text += (text.empty() ? "" : ", ") + text_of(item);
  return "[" + text + "]";
}

RecordedWire wire_of(const YAML::Node& value) {
  RecordedWire wire{text_of(value), {}};
  const auto add = [&](const YAML::Node& source) { wire.from.push_back(source.Scalar().substr(0, source.Scalar().find('.'))); };
  if (value.IsSequence())
    for (const YAML::Node& source : value) add(source);
  else
    add(value);
  return wire;
}

std::vector<RecordedItem> items_of(const json& list) {
  std::vector<RecordedItem> items;
  for (const json& item : list) items.push_back({item.at(0), item.at(1)});
  return items;
}

void add_record(const json& recorded, RecordedNode& node) {
  node.status = recorded.at("status");
  node.reason = recorded.value("reason", "");
  node.library = recorded.value("library", "");
  node.build_id = recorded.value("build_id", "");
  node.random = recorded.value("random", false);
  const json functions = recorded.value("functions", json::array()), items = recorded.value("items", json::object());
  const json inputs = recorded.value("inputs", json::object()), files = recorded.value("files", json::object());
  for (const auto& [name, key] : recorded.at("keys").items()) {
    const bool is_function = std::find(functions.begin(), functions.end(), name) != functions.end();
    node.outputs.push_back({name, key, is_function, items_of(items.value(name, json::array()))});
  }
  for (const auto& [port, key] : inputs.items()) node.input_keys[port] = key;
  for (const auto& [option, content] : files.items())
    node.files[option] = content.is_null() ? std::nullopt : std::optional(content.get<std::string>());
}

/// The nodes of the resolved pipeline that the run's record speaks of.
void read_nodes(const fs::path& file, const json& record, RunRecord& run) {
  const YAML::Node pipeline = YAML::LoadFile(file.string());
  for (const auto& entry : pipeline["nodes"]) {
    RecordedNode node;
    node.id = entry.first.Scalar();
    const auto recorded = std::find_if(record.at("nodes").begin(), record.at("nodes").end(), [&](const json& one) { return one.at("id") == node.id; });
    if (recorded == record.at("nodes").end()) continue;
    node.uses = entry.second["uses"].Scalar();
    for (const auto& wire : entry.second["in"]) node.wires[wire.first.Scalar()] = wire_of(wire.second);
    for (const auto& option : entry.second["with"]) node.options[option.first.Scalar()] = text_of(option.second);
    add_record(*recorded, node);
    if (!recorded->contains("items"))
      throw Error((run.folder / "run.json").string() + " was written by an older marrow, which kept too little to compare it; run its pipeline.yaml again, with --seed " +
                  std::to_string(run.seed));
    run.nodes.push_back(std::move(node));
  }
}

RunRecord from_json(const fs::path& folder, const json& record) {
  RunRecord run;
  run.folder = folder;
  run.pipeline = record.at("pipeline");
  run.status = record.at("status");
  run.framework = record.value("framework", "");
  run.cpu_level = record.value("cpu_level", "");
  run.seed = record.at("seed");
  run.threads = record.value("threads", 0);
  const json inputs = record.value("inputs", json::object());
  for (const auto& [name, value] : inputs.items()) run.arguments.inputs.emplace_back(name, value);
  for (const std::string text : record.value("overrides", json::array())) run.arguments.overrides.push_back({text.substr(0, text.find('=')), text.substr(text.find('=') + 1)});
  for (const json& plugin : record.value("plugins", json::array())) run.plugins[plugin.at("file")] = plugin.at("build_id");
  for (const json& output : record.value("outputs", json::array()))
    run.results.push_back({output.at("name"), output.value("fault", ""), items_of(output.value("items", json::array())), output.value("files", std::vector<std::string>())});
  read_nodes(folder / "pipeline.yaml", record, run);
  return run;
}

}  // namespace

std::vector<const RecordedOutput*> RecordedNode::data() const {
  std::vector<const RecordedOutput*> data;
  for (const RecordedOutput& output : outputs)
    if (!output.is_function) data.push_back(&output);
  return data;
}

fs::path RecordedResult::file_of(const fs::path& folder, const std::string& place) const {
  std::size_t at = 0;
  const std::size_t present = std::size_t(std::count_if(items.begin(), items.end(), [](const RecordedItem& item) { return !item.is_absent(); }));
  if (present != files.size()) return {};  // one of them could not be written
  for (const RecordedItem& item : items) {
    if (item.is_absent()) continue;
    if (item.place == place) return folder / files[at];
    ++at;
  }
  return {};
}

const RecordedNode* RunRecord::find(const std::string& id) const {
  const auto found = std::find_if(nodes.begin(), nodes.end(), [&](const RecordedNode& node) { return node.id == id; });
  return found == nodes.end() ? nullptr : &*found;
}

RunRecord read_run(const fs::path& folder) {
  std::error_code error;
  const std::string advice = "; give a folder that 'marrow run' wrote, or one of the cells of a comparison (FOLDER/cells/VARIANT/CASE/START)";
  if (!fs::is_directory(folder, error)) throw Error(folder.string() + " is not a folder" + advice);
  const bool has_pipeline = fs::exists(folder / "pipeline.yaml", error);
  if (!fs::exists(folder / "run.json", error)) {
    if (has_pipeline) throw Error("the run in " + folder.string() + " did not come to its end: it has a pipeline.yaml, but no run.json; run it again");
    throw Error(folder.string() + " is not the folder of a run: it has no run.json" + advice);
  }
  if (!has_pipeline) throw Error(folder.string() + " is not the whole folder of a run: it has a run.json, but no pipeline.yaml" + advice);
  try {
    return from_json(folder, json::parse(text_of_file(folder / "run.json")));
  } catch (const json::exception& fault) {
    throw Error((folder / "run.json").string() + " is not what 'marrow run' wrote: " + fault.what() + "; run it again");
  } catch (const YAML::Exception& fault) {
    throw Error((folder / "pipeline.yaml").string() + " is not what 'marrow run' wrote: " + fault.what() + "; run it again");
  }
}

}  // namespace marrow::cli
