// SPDX-License-Identifier: Apache-2.0
#include "workbench/pipeline.hpp"

#include "commands.hpp"
#include "marrow/base/yaml.hpp"
#include "report/report.hpp"
#include "workbench/yaml_text.hpp"

namespace marrow::workbench {
namespace {

using nlohmann::json;

std::string scalar_of(const YAML::Node& map, const char* key) {
  const YAML::Node value = map.IsMap() ? map[key] : YAML::Node();
  return value.IsDefined() && value.IsScalar() ? value.Scalar() : "";
}

json inputs_of(const YamlText& yaml) {
  json inputs = json::array();
  const YAML::Node section = yaml.root().IsMap() ? yaml.root()["inputs"] : YAML::Node();
  if (!section.IsDefined() || !section.IsMap()) return inputs;
  for (const auto& pair : section) {
    if (!pair.first.IsScalar()) continue;
    const bool has_default = pair.second.IsMap() && pair.second["default"].IsDefined();
    inputs.push_back({{"name", pair.first.Scalar()},
                      {"type", scalar_of(pair.second, "type")},
                      {"help", scalar_of(pair.second, "help")},
                      {"default", has_default ? json(scalar_of(pair.second, "default")) : json()}});
  }
  return inputs;
}

/// The inputs that the file has, its own and those of files that it extends. A default is shown as it is written.
json inputs_of(const YamlText& yaml, const Pipeline& pipeline) {
  const json written = inputs_of(yaml);
  if (pipeline.inputs.empty()) return written;
  json inputs = json::array();
  for (const PipelineInput& input : pipeline.inputs) {
    if (input.is_data) continue;
    json shown = {{"name", input.name},
                  {"type", input.type},
                  {"help", input.help},
                  {"default", input.has_default ? json(input.default_text) : json()}};
    for (const json& own : written)
      if (own["name"] == input.name && !own["default"].is_null()) shown["default"] = own["default"];
    inputs.push_back(std::move(shown));
  }
  return inputs;
}

/// {name: what is written} of a map in the text. Scalars come without quotes.
json written(const YamlText& yaml, const YAML::Node& map) {
  json all = json::object();
  if (!map.IsDefined() || !map.IsMap()) return all;
  for (const YamlEntryText& entry : yaml.entries(map))
    all[entry.key] = entry.value.IsScalar()
                         ? entry.value.Scalar()
                         : yaml.text().substr(entry.value_begin, entry.value_end - entry.value_begin);
  return all;
}

json written_nodes(const YamlText& yaml) {
  json nodes = json::object();
  const YAML::Node section = yaml.root().IsMap() ? yaml.root()["nodes"] : YAML::Node();
  if (!section.IsDefined() || !section.IsMap()) return nodes;
  for (const auto& pair : section) {
    if (!pair.first.IsScalar() || !pair.second.IsMap()) continue;
    const YAML::Node& node = pair.second;
    nodes[pair.first.Scalar()] = {{"line", pair.first.Mark().line + 1},
                                  {"uses", scalar_of(node, "uses")},
                                  {"body", scalar_of(node, "repeat")},
                                  {"is_repeated", node["repeat"].IsDefined()},
                                  {"may_fail", scalar_of(node, "may_fail") == "true"},
                                  {"with", written(yaml, node["with"])},
                                  {"in", written(yaml, node["in"])}};
  }
  return nodes;
}

/// The form of a node: what is written, what its manifest says, and where what another file says is written.
void add_manifest(json& node, const PipelineNode& known, const Pipeline& pipeline) {
  node["info"] = cli::node_json(known.info);
  const auto origin = [&](const Place& place) {
    return place.file == known.place.file ? std::string() : place_text(place, pipeline.file);
  };
  node["uses_written"] = origin(known.uses_place);
  for (std::size_t i = 0; i < known.info.options.size(); ++i) {
    json& option = node["info"]["options"][i];
    option["default"] = cli::yaml_text(known.info.options[i].default_value);
    option["now"] = cli::yaml_text(known.options[i]);
    option["written"] = origin(known.option_places[i]);
  }
}

/// A node that another file has: one that this file extends, or a part. It is shown, and not changed here.
json node_of_another_file(const PipelineNode& node, const Workbench& workbench) {
  std::error_code outside;
  const std::filesystem::path file =
      std::filesystem::relative(std::filesystem::absolute(node.place.file), workbench.folder.path(), outside);
  return {{"line", node.place.line},
          {"uses", node.info.name},
          {"body", ""},
          {"is_repeated", false},
          {"may_fail", node.may_fail},
          {"with", json::object()},
          {"in", json::object()},
          {"file", outside ? node.place.file : file.string()}};
}

void add_node(json& nodes, const PipelineNode& node, const Pipeline& pipeline, const Workbench& workbench) {
  if (node.stands_for_input) return;
  json& shown = nodes[node.id];
  if (shown.is_null()) shown = node_of_another_file(node, workbench);
  if (shown["uses"] == "" && !node.repetition) shown["uses"] = node.info.name;
  add_manifest(shown, node, pipeline);
}

}  // namespace

void describe_pipeline(json& state, const Workbench& workbench) {
  const std::string file = state["file"];
  Diagnostics diagnostics;
  const Pipeline pipeline = read_pipeline(workbench.folder.inside(file), {}, workbench.catalogue, diagnostics, false);
  check_writers(pipeline, workbench.catalogue, diagnostics);
  state["faults"] = cli::faults_json(diagnostics);
  state["faults_text"] = diagnostics.text();
  state["graph"] = nullptr;
  state["nodes"] = json::object();
  state["inputs"] = state["outputs"] = json::array();
  try {
    const YamlText yaml(state["text"].get<std::string>());
    state["inputs"] = inputs_of(yaml, pipeline);
    state["nodes"] = written_nodes(yaml);
  } catch (const Error&) {  // not YAML at all; the faults say so
  }
  if (!diagnostics.empty()) return;
  state["name"] = pipeline.name;
  state["help"] = pipeline.help;
  state["graph"] = cli::graph_of(pipeline, {});
  for (const PipelineNode& node : pipeline.nodes) add_node(state["nodes"], node, pipeline, workbench);
  for (const PipelineOutput& output : pipeline.outputs)
    state["outputs"].push_back({{"name", output.name}, {"source", output.source.text}});
}

PipelineArguments arguments_of_form(const std::string& file, const json& inputs, const Workbench& workbench) {
  PipelineArguments arguments;
  if (!inputs.is_object() || inputs.empty()) return arguments;
  const YamlText yaml(read_text_file(workbench.folder.inside(file), kMostSourceBytes));
  Diagnostics faults;  // told where the pipeline is read with its inputs
  const Pipeline pipeline = read_pipeline(workbench.folder.inside(file), {}, workbench.catalogue, faults, false);
  for (const json& input : inputs_of(yaml, pipeline)) {
    const std::string name = input["name"], type = input["type"];
    if (!inputs.contains(name) || !inputs[name].is_string()) continue;
    std::string value = inputs[name];
    if (value.empty()) continue;
    if (type == "path") value = workbench.folder.inside(value).string();
    arguments.inputs.push_back({name, value});
  }
  return arguments;
}

Pipeline pipeline_of_form(const std::string& file, const json& inputs, const Workbench& workbench) {
  Diagnostics diagnostics;
  Pipeline pipeline = read_pipeline(workbench.folder.inside(file), arguments_of_form(file, inputs, workbench),
                                    workbench.catalogue, diagnostics);
  check_writers(pipeline, workbench.catalogue, diagnostics);
  if (!diagnostics.empty()) throw Error(diagnostics.text());
  return pipeline;
}

std::string command_of_form(const std::string& command, const std::string& file, const json& inputs,
                            const Workbench& workbench) {
  std::string text = command_in_folder(workbench, command + " " + cli::shell_path(file));
  if (inputs.is_object())
    for (const auto& [name, value] : inputs.items())
      if (value.is_string() && !value.get<std::string>().empty())
        text += " " + cli::shell_word(name) + "=" + cli::shell_word(value.get<std::string>());
  return text;
}

std::vector<std::string> faults_of(const std::string& file, const std::vector<Override>& overrides,
                                   const Workbench& workbench) {
  Diagnostics diagnostics;
  const Pipeline pipeline =
      read_pipeline(workbench.folder.inside(file), {{}, overrides}, workbench.catalogue, diagnostics, false);
  if (diagnostics.empty()) check_writers(pipeline, workbench.catalogue, diagnostics);
  std::vector<std::string> faults;
  for (const Diagnostic& one : diagnostics.sorted())
    faults.push_back(one.message + (one.hint.empty() ? "" : "; " + one.hint));
  return faults;
}

}  // namespace marrow::workbench
