// SPDX-License-Identifier: Apache-2.0
#include "difference/difference.hpp"

#include <yaml-cpp/yaml.h>

#include <algorithm>
#include <set>

#include "command_options.hpp"
#include "marrow/base/json_text.hpp"
#include "marrow/base/printable.hpp"
#include "marrow/runtime/pipeline/named_files.hpp"
#include "run_files.hpp"

namespace marrow::cli {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;

/// A scalar as it is written, or a list as [a, b].
std::string text_of(const YAML::Node& value) {
  if (!value.IsSequence()) return value.IsScalar() ? value.Scalar() : "";
  std::string text;
  for (const YAML::Node& item : value) text += (text.empty() ? "" : ", ") + text_of(item);
  return "[" + text + "]";
}

std::string node_in(const std::string& reference) { return reference.substr(0, reference.find('.')); }

std::vector<std::string> references_in(const YAML::Node& value) {
  std::vector<std::string> references;
  if (!value.IsSequence()) return {value.Scalar()};
  for (const YAML::Node& source : value) references.push_back(source.Scalar());
  return references;
}

/// What the nodes of a body get from outside, by node or node.output of the body.
struct GivenToBody {
  std::map<std::string, std::vector<std::string>> from, from_pass_before;
};

/// `path`: of the body that the node is in ("track/"), or "".
RecordedWire wire_of(const YAML::Node& value, const std::string& path, const GivenToBody& given) {
  RecordedWire wire{text_of(value), {}, {}};
  for (const std::string& reference : references_in(value)) {
    const auto from = given.from.find(reference), before = given.from_pass_before.find(reference);
    if (before != given.from_pass_before.end()) wire.from_pass_before = before->second;
    if (from != given.from.end())
      wire.from.insert(wire.from.end(), from->second.begin(), from->second.end());
    else
      wire.from.push_back(path + node_in(reference));
  }
  return wire;
}

/// `path`: of the body.
GivenToBody given_by(const YAML::Node& node, const std::map<std::string, RecordedWire>& wires,
                     const std::string& path) {
  GivenToBody given;
  for (const auto& [port, wire] : wires) given.from[port] = wire.from;
  const YAML::Node outputs = node["repeat"]["outputs"];
  for (const auto& carried : node["carry"])
    for (const auto& output : outputs)
      if (output.first.Scalar() == carried.second.Scalar())
        given.from_pass_before[carried.first.Scalar()] = {path + node_in(output.second.Scalar())};
  return given;
}

/// A key or the digest of a content: 32 hexadecimal digits.
std::string digest_of(const json& value) {
  const std::string text = value;
  if (text.size() != 32 || text.find_first_not_of("0123456789abcdef") != std::string::npos)
    throw Error("a key in it has not 32 hexadecimal digits");
  return text;
}

/// Build id of a plugin or of the framework. Empty if there is none.
std::string build_id_of(const json& object, const char* name) {
  return object.contains(name) ? digest_of(object[name]) : "";
}

std::string status_of(const json& object) {
  static const std::set<std::string> kKnown{"not needed", "done",      "skipped",     "failed",
                                            "not run",    "cancelled", "failed alone"};
  const std::string status = object.at("status");
  if (!kKnown.contains(status)) throw Error("it says 'status': " + in_quotes(printable(status)));
  return status;
}

std::uint64_t seed_of(const json& seed) {
  if (!seed.is_number_unsigned()) throw Error("its 'seed' is no whole number of 0 or more");
  return seed;
}

json list_in(const json& object, const char* name) {
  const json list = object.value(name, json::array());
  if (!list.is_array()) throw Error("its '" + std::string(name) + "' is no list");
  return list;
}

json map_in(const json& object, const char* name) {
  const json map = object.value(name, json::object());
  if (!map.is_object()) throw Error("its '" + std::string(name) + "' is no object");
  return map;
}

/// A limit for reading files. 0 if the run had no such limit.
double limit_in(const json& record, const char* name) {
  if (!record.contains(name)) return 0;
  const double limit = record[name].is_number() ? record[name].get<double>() : 0;
  if (!(limit >= kLeastAmount && limit <= kMostAmount))
    throw Error("its '" + std::string(name) + "' is no number from 0.001 to 1000000000");
  return limit;
}

std::vector<RecordedItem> items_of(const json& list) {
  std::vector<RecordedItem> items;
  for (const json& item : list) items.push_back({item.at(0), digest_of(item.at(1))});
  return items;
}

void add_record(const json& recorded, RecordedNode& node) {
  node.status = status_of(recorded);
  node.reason = recorded.value("reason", "");
  node.library = recorded.value("library", "");
  node.build_id = build_id_of(recorded, "build_id");
  node.random = recorded.value("random", false);
  const json written = map_in(recorded, "written"), option_places = map_in(written, "options");
  node.uses_place = written.value("uses", "");
  for (const auto& [option, place] : option_places.items()) node.option_places[option] = place;
  const json functions = list_in(recorded, "functions"), items = map_in(recorded, "items");
  const json inputs = map_in(recorded, "inputs"), files = map_in(recorded, "files");
  for (const auto& [name, key] : recorded.at("keys").items()) {
    const bool is_function = std::find(functions.begin(), functions.end(), name) != functions.end();
    node.outputs.push_back({name, digest_of(key), is_function, items_of(list_in(items, name.c_str()))});
  }
  for (const auto& [port, key] : inputs.items()) node.input_keys[port] = digest_of(key);
  for (const auto& [option, content] : files.items())
    node.files[option] = content.is_null() ? std::nullopt : std::optional(digest_of(content));
  if (recorded.contains("program_version"))
    node.options["version_command"] += " (printed " + in_quotes(recorded["program_version"].get<std::string>()) + ")";
}

[[noreturn]] void refuse_pipeline(const fs::path& file, const std::string& why) {
  throw Error(file.string() + " is not what 'marrow run' wrote: " + why + "; run it again");
}

/// Anything that could crash the reader is refused.
void check_graph(const YAML::Node& graph, const fs::path& file) {
  if (!graph.IsMap() || !graph["nodes"].IsDefined() || !graph["nodes"].IsMap())
    refuse_pipeline(file, "it holds no pipeline");
  for (const auto& node : graph["nodes"]) {
    if (!node.second.IsMap())
      refuse_pipeline(file, "its node " + in_quotes(printable(node.first.Scalar())) + " is no map");
    if (node.second["repeat"].IsDefined()) check_graph(node.second["repeat"], file);
  }
}

/// The resolved pipeline that the run wrote. Anything that could crash the reader is refused.
YAML::Node pipeline_of(const fs::path& file) {
  Diagnostics faults;
  YAML::Node pipeline;
  if (const auto text = read_source(file, "the pipeline", faults))
    pipeline = StrictYaml(file.string(), faults).parse(*text);
  if (!faults.empty()) refuse_pipeline(file, faults.sorted()[0].message);
  check_graph(pipeline, file);
  return pipeline;
}

/// Takes what decides how a body runs as options of the node.
void read_repetition(const YAML::Node& written, RecordedNode& node) {
  node.uses = "repeat";
  for (const char* key : {"over", "at_most", "until", "if_pass_fails"})
    if (written[key].IsDefined()) node.options[key] = text_of(written[key]);
  for (const auto& carried : written["carry"])
    node.options["carry." + carried.first.Scalar()] = text_of(carried.second);
}

using RecordedNodes = std::map<std::string, const json*>;

/// Reads the nodes of a graph that are in the run's record, and those of their bodies.
void read_graph(const YAML::Node& graph, const std::string& path, const GivenToBody& given,
                const RecordedNodes& recorded, RunRecord& run) {
  for (const auto& entry : graph["nodes"]) {
    const YAML::Node written = entry.second;
    RecordedNode node;
    node.id = path + entry.first.Scalar();
    const auto found = recorded.find(node.id);
    if (found == recorded.end()) {
      run.not_needed.insert(node.id);
      continue;
    }
    for (const auto& wire : written["in"]) node.wires[wire.first.Scalar()] = wire_of(wire.second, path, given);
    for (const auto& option : written["with"]) node.options[option.first.Scalar()] = text_of(option.second);
    const bool has_body = written["repeat"].IsDefined();
    if (has_body)
      read_repetition(written, node);
    else
      node.uses = written["uses"].IsDefined() ? written["uses"].Scalar() : "";
    add_record(*found->second, node);
    const std::string id = node.id;
    const auto wires = node.wires;
    run.places.emplace(id, run.nodes.size());
    run.nodes.push_back(std::move(node));
    if (has_body) read_graph(written["repeat"], id + "/", given_by(written, wires, id + "/"), recorded, run);
  }
}

void read_nodes(const YAML::Node& pipeline, const json& record, RunRecord& run) {
  RecordedNodes recorded;
  if (!record.at("nodes").is_array()) throw Error("its 'nodes' is no list");
  for (const json& one : record.at("nodes")) recorded.emplace(one.at("id"), &one);
  read_graph(pipeline, "", {}, recorded, run);
  for (const auto& [id, one] : recorded)
    if (!run.places.contains(id)) throw Error("its node " + in_quotes(printable(id)) + " is none of pipeline.yaml");
}

void check_age(const fs::path& folder, const json& record) {
  const json nodes = record.contains("nodes") ? record["nodes"] : json();
  const auto is_new = [](const json& node) { return !node.is_object() || node.contains("items"); };
  if (!nodes.is_array() || std::all_of(nodes.begin(), nodes.end(), is_new)) return;
  throw Error((folder / "run.json").string() +
              " was written by an older marrow, which kept too little to compare it; run its pipeline.yaml again, with "
              "--seed " +
              (record.contains("seed") && record["seed"].is_number() ? record["seed"].dump() : "1"));
}

bool holds(const fs::path& file, const std::string& content) {
  try {
    return content_of(file).hex() == content;
  } catch (const Error&) {  // the file can no longer be read
    return false;
  }
}

RunRecord from_json(const fs::path& folder, const YAML::Node& pipeline, const json& record) {
  RunRecord run;
  run.folder = folder;
  run.version = record.value("marrow", "");
  run.pipeline = record.at("pipeline");
  run.status = status_of(record);
  run.framework = build_id_of(record, "framework");
  run.cpu_level = record.value("cpu_level", "");
  run.seed = seed_of(record.at("seed"));
  run.threads = int(integer_of(record.value("threads", json(0)), 0, 1024, "its 'threads'"));
  const json inputs = map_in(record, "inputs");
  for (const auto& [name, value] : inputs.items()) run.arguments.inputs.push_back({name, value});
  for (const std::string text : list_in(record, "overrides"))
    run.arguments.overrides.push_back({text.substr(0, text.find('=')), text.substr(text.find('=') + 1)});
  for (const json& plugin : list_in(record, "plugins"))
    run.plugins[plugin.at("file")] = digest_of(plugin.at("build_id"));
  run.file_limits = {limit_in(record, "file_memory_mb"), limit_in(record, "file_seconds")};
  for (const json& output : list_in(record, "outputs")) {
    run.results.push_back({output.at("name"),
                           output.value("fault", ""),
                           items_of(list_in(output, "items")),
                           output.value("files", std::vector<std::string>()),
                           {}});
    for (const json& content : list_in(output, "digests"))
      run.results.back().contents.push_back(content.is_null() ? "" : digest_of(content));
  }
  read_nodes(pipeline, record, run);
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
  const std::size_t present = std::size_t(
      std::count_if(items.begin(), items.end(), [](const RecordedItem& item) { return !item.is_absent(); }));
  if (present != files.size()) return {};  // one of the files could not be written
  for (const RecordedItem& item : items) {
    if (item.is_absent()) continue;
    if (item.place == place) {
      const fs::path file = file_of_run(folder, files[at]).value_or(fs::path());
      const bool is_damaged = at < contents.size() && !contents[at].empty() && !holds(file, contents[at]);
      return is_damaged ? fs::path() : file;
    }
    ++at;
  }
  return {};
}

const RecordedNode* RunRecord::find(const std::string& id) const {
  const auto found = places.find(id);
  return found == places.end() ? nullptr : &nodes[found->second];
}

std::vector<std::string> damaged_files(const RunRecord& run) {
  std::vector<std::string> damaged;
  for (const RecordedResult& result : run.results)
    for (std::size_t i = 0; i < std::min(result.files.size(), result.contents.size()); ++i) {
      if (result.contents[i].empty()) continue;
      const std::string name = (run.folder / result.files[i]).string();
      std::error_code error;
      if (leads_outside(run.folder, result.files[i]))
        damaged.push_back(name + " leads out of the folder");
      else if (!fs::exists(run.folder / result.files[i], error))
        damaged.push_back(name + " is missing");
      else if (!holds(run.folder / result.files[i], result.contents[i]))
        damaged.push_back(name + " was changed since the run wrote it");
    }
  return damaged;
}

RunRecord read_run(const fs::path& folder) {
  expect_given(folder, Wanted::run);
  std::error_code error;
  const std::string advice =
      "; give a folder that 'marrow run' wrote, or one of the cells of a comparison (FOLDER/cells/VARIANT/CASE/START)";
  if (!fs::is_directory(folder, error)) throw Error(folder.string() + " is not a folder" + advice);
  const bool has_pipeline = fs::exists(folder / "pipeline.yaml", error);
  if (!fs::exists(folder / "run.json", error)) {
    if (has_pipeline)
      throw Error("the run in " + folder.string() +
                  " did not come to its end: it has a pipeline.yaml, but no run.json; run it again");
    throw Error(folder.string() + " is not the folder of a run: it has no run.json" + advice);
  }
  if (!has_pipeline)
    throw Error(folder.string() + " is not the whole folder of a run: it has a run.json, but no pipeline.yaml" +
                advice);
  refuse_outside(folder, "pipeline.yaml");
  const json record = read_record(folder);
  const YAML::Node pipeline = pipeline_of(folder / "pipeline.yaml");
  check_age(folder, record);
  try {
    return from_json(folder, pipeline, record);
  } catch (const Error& fault) {
    refuse_record(folder, fault.what());
  } catch (const json::exception&) {
    refuse_record(folder, "what it should say is missing in it, or of another type");
  } catch (const YAML::Exception&) {  // its own message would name operators of yaml-cpp
    refuse_pipeline(folder / "pipeline.yaml", "what it should say is missing in it, or of another type");
  }
}

}  // namespace marrow::cli
