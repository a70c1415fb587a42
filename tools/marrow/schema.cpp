// SPDX-License-Identifier: Apache-2.0
// The JSON Schema (draft 7) of pipeline files, made from the nodes that are installed.
#include <cstdio>
#include <map>
#include <nlohmann/json.hpp>

#include "command_options.hpp"
#include "marrow/base/text_file.hpp"

namespace marrow::cli {
namespace {

using Json = nlohmann::ordered_json;

Json reference_to(const std::string& definition) { return {{"$ref", "#/definitions/" + definition}}; }

std::string inputs_of(const std::string& kind) { return kind + ".inputs"; }

std::string nodes_of(const std::string& kind) { return kind + ".nodes"; }

Json scalar_schema(const OptionInfo& option) {
  Json value;
  switch (option.type) {
    case OptionType::boolean:
      value = {{"type", "boolean"}};
      break;
    case OptionType::integer:
      value = {{"type", "integer"}};
      break;
    case OptionType::number:
    case OptionType::numbers:
      value = {{"type", "number"}};
      break;
    default:
      value = {{"type", {"string", "number", "boolean"}}};
      break;
  }
  if (option.minimum) value["minimum"] = *option.minimum;
  if (option.maximum) value["maximum"] = *option.maximum;
  if (!option.choices.empty()) value = {{"enum", option.choices}};
  return {{"anyOf", {value, reference_to("name_of_input")}}};
}

Json option_schema(const OptionInfo& option) {
  Json schema = scalar_schema(option);
  if (option.type == OptionType::numbers || option.type == OptionType::texts || option.type == OptionType::paths) {
    schema = {{"type", "array"}, {"items", schema}};
    if (option.length) schema["minItems"] = schema["maxItems"] = option.length;
  }
  if (!option.required) std::visit([&](const auto& value) { schema["default"] = value; }, option.default_value);
  schema["description"] = option.help + " (" + range_text(option) + ")";
  return schema;
}

Json inputs_schema(const std::vector<KindPort>& ports) {
  Json properties = Json::object();
  for (const KindPort& port : ports) {
    properties[port.name] = reference_to("wire");
    properties[port.name]["description"] = port_text(port) + (port.help.empty() ? "" : ": " + port.help);
  }
  return {{"type", "object"}, {"additionalProperties", false}, {"properties", properties}};
}

Json if_used(const Json& names, const Json& schema) {
  return {{"if", {{"required", {"uses"}}, {"properties", {{"uses", {{"enum", names}}}}}}}, {"then", schema}};
}

/// What one node may have: its options, and the inputs of its kind.
Json node_schema(const NodeInfo& node) {
  Json with = {{"type", "object"}, {"additionalProperties", false}, {"properties", Json::object()}};
  for (const OptionInfo& option : node.options) with["properties"][option.name] = option_schema(option);
  return if_used(Json::array({node.name}),
                 {{"properties", {{"with", with}, {"in", reference_to(inputs_of(node.kind()))}}}});
}

/// What nodes must have in a file that extends no other one. Nodes that need the same are told together.
Json whole_node_schema(const Catalogue& catalogue) {
  std::map<std::string, Json> users;  // by what they need
  for (const std::string& name : catalogue.node_names()) {
    const NodeInfo& node = *catalogue.find(name);
    Json needs = Json::object();
    for (const OptionInfo& option : node.options)
      if (option.required) needs["with"]["required"].push_back(option.name);
    for (const PortInfo& port : node.inputs)
      if (!port.optional) needs["in"]["required"].push_back(port.name);
    if (!needs.empty()) users[needs.dump()].push_back(name);
  }
  Json all = {reference_to("node_change"), {{"anyOf", {{{"required", {"uses"}}}, {{"required", {"repeat"}}}}}}};
  for (const auto& [text, names] : users) {
    const Json needs = Json::parse(text);
    Json sections = Json::array();
    for (const auto& [section, required] : needs.items()) sections.push_back(section);
    all.push_back(if_used(names, {{"required", sections}, {"properties", needs}}));
  }
  return {{"allOf", all}};
}

Json any_node_schema(const Catalogue& catalogue) {
  Json uses = Json::array(), conditions = Json::array();
  for (const std::string& name : catalogue.node_names()) {
    const NodeInfo& node = *catalogue.find(name);
    const Json of_kind = reference_to(nodes_of(node.kind()));
    if (uses.empty() || uses.back() != of_kind) uses.push_back(of_kind);
    conditions.push_back(node_schema(node));
  }
  const Json place = {{"type", "string"}};
  uses.push_back({{"pattern", "\\.ya?ml$"}, {"description", "a pipeline file, whose inputs are options and ports"}});
  return {{"type", {"object", "null"}},
          {"additionalProperties", false},
          {"properties",
           {{"uses", {{"description", "kind.name of the node, or a pipeline file"}, {"anyOf", uses}}},
            {"with", {{"type", "object"}, {"description", "options"}}},
            {"in", {{"type", "object"}, {"description", "port: node, node.output or node.output.item"}}},
            {"may_fail",
             {{"type", "boolean"},
              {"default", false},
              {"description", "whether the run goes on without the node's outputs if it fails"}}},
            {"set", reference_to("changes")},
            {"repeat",
             {{"description", "the body that is run again and again: a pipeline file, or nodes and outputs"},
              {"anyOf", {place, reference_to("body")}}}},
            {"over", {{"type", "string"}, {"description", "the axis of the items that passes are for"}}},
            {"carry",
             {{"type", "object"},
              {"additionalProperties", place},
              {"description", "node of the body: output of the body that takes its place in the next pass"}}},
            {"at_most", {{"type", "integer"}, {"minimum", 1}, {"description", "number of passes"}}},
            {"until", {{"type", "string"}, {"description", "output of the body, of type stop, that ends the passes"}}},
            {"if_pass_fails",
             {{"enum", {"end", "go_on"}}, {"default", "end"}, {"description", "what follows a failed pass"}}}}},
          {"allOf", conditions}};
}

/// The parts that a pipeline and the body of a repetition have in common.
Json common_parts(const Catalogue& catalogue) {
  Json types = {"path", "text", "number", "integer", "boolean"};
  for (const auto& [name, type] : catalogue.types()) types.push_back(name);
  const Json input = {
      {"type", {"object", "null"}},
      {"additionalProperties", false},
      {"properties",
       {{"type",
         {{"enum", types}, {"description", "type of its values; data make the file a part of other pipelines"}}},
        {"default",
         {{"type", {"string", "number", "boolean", "null"}},
          {"description", "its value if none is given; without it, one must be given"}}},
        {"over", {{"type", "string"}, {"description", "of data: the axis of a list; without it, one item"}}},
        {"optional", {{"type", "boolean"}, {"description", "of data: whether a user of the part may leave it out"}}},
        {"help", {{"type", "string"}, {"description", "what it means, for those who give it"}}}}}};
  return {{"inputs",
           {{"type", "object"},
            {"description", "values that are given on the command line as name=value; $name stands for one"},
            {"additionalProperties", input}}},
          {"nodes",
           {{"type", "object"},
            {"description", "the nodes by their names, in any order"},
            {"additionalProperties", reference_to("node_change")}}},
          {"outputs",
           {{"type", "object"},
            {"description", "what is computed and written: name of the output, and node or node.output"},
            {"additionalProperties", {{"type", {"string", "null"}}}}}}};
}

Json definitions(const Catalogue& catalogue) {
  const Json text = {{"type", "string"}};
  Json all = {{"node_change", any_node_schema(catalogue)},
              {"node", whole_node_schema(catalogue)},
              {"whole", {{"properties", {{"nodes", {{"additionalProperties", reference_to("node")}}}}}}},
              {"body",
               {{"type", "object"},
                {"required", {"nodes", "outputs"}},
                {"allOf", Json::array({reference_to("whole")})},
                {"additionalProperties", false},
                {"properties", common_parts(catalogue)}}},
              // An option's value may be the name of an input of the pipeline, whatever the option's type.
              {"name_of_input", {{"type", "string"}, {"pattern", "\\$"}}},
              {"changes",
               {{"type", "object"},
                {"description", "changes, as --set has them: node.option, node.uses, node.in.port; null removes"}}},
              {"wire", {{"anyOf", {text, {{"type", "array"}, {"items", text}}, {{"type", "null"}}}}}}};
  for (const std::string& kind : catalogue.kind_names())
    all[inputs_of(kind)] = inputs_schema(catalogue.ports_of_kind(kind));
  for (const std::string& name : catalogue.node_names()) {
    const NodeInfo& node = *catalogue.find(name);
    all[nodes_of(node.kind())]["anyOf"].push_back({{"const", name}, {"description", node.summary}});
  }
  return all;
}

Json pipeline_schema(const Catalogue& catalogue) {
  Json properties = {
      {"marrow", {{"const", 1}, {"description", "version of the format"}}},
      {"name",
       {{"type", "string"}, {"description", "of the folder that a run writes, runs/NAME (default: the file's name)"}}},
      {"extends", {{"type", "string"}, {"description", "pipeline file over which this one puts its own"}}},
      {"set", reference_to("changes")},
      {"help", {{"type", "string"}, {"description", "what the pipeline does, and for which data"}}},
      {"only_inside",
       {{"type", "boolean"},
        {"description", "no command runs it, but the program itself, so no file need hold its outputs"}}}};
  properties.update(common_parts(catalogue));
  return {{"$schema", "http://json-schema.org/draft-07/schema#"},
          {"title", "marrow pipeline"},
          {"type", "object"},
          {"required", {"marrow"}},
          {"if", {{"required", {"extends"}}}},
          {"then", true},
          {"else", {{"required", {"nodes", "outputs"}}, {"allOf", Json::array({reference_to("whole")})}}},
          {"additionalProperties", false},
          {"properties", properties},
          {"definitions", definitions(catalogue)}};
}

/// Whether the members of a value begin a line each: only in the large values around the nodes and definitions, so
/// that a change of one node changes few lines. What is inside a node stays on one line.
bool is_broken(const Json& value) {
  constexpr std::size_t most_bytes = 16000;  // no node's definition is longer
  return value.is_structured() && value.dump().size() > most_bytes;
}

std::string laid_out(const Json& value) {
  if (!is_broken(value)) return value.dump();
  std::string text;
  for (const auto& [name, member] : value.items()) {
    text += text.empty() ? "\n" : ",\n";
    text += (value.is_object() ? Json(name).dump() + ":" : "") + laid_out(member);
  }
  return value.is_object() ? "{" + text + "\n}" : "[" + text + "\n]";
}

int schema(const std::filesystem::path& file) {
  const std::string text = laid_out(pipeline_schema(Catalogue())) + "\n";
  if (file.empty()) {
    std::fputs(text.c_str(), stdout);
    return 0;
  }
  write_text_file(file, text, Kinds::files_and_pipes);
  return 0;
}

}  // namespace

void add_schema(CLI::App& app, int& code) {
  const auto file = std::make_shared<std::filesystem::path>();
  CLI::App* command =
      app.add_subcommand("schema", "print the JSON Schema of pipelines, with which editors complete and check them");
  command->add_option("-o,--out", *file, "write it to this file; an existing one is replaced")->type_name("FILE");
  command->callback([file, &code] { code = schema(*file); });
  say_that_libraries_are_described(command);
}

}  // namespace marrow::cli
