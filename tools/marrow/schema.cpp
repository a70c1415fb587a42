// SPDX-License-Identifier: Apache-2.0
// The JSON Schema (draft 7) of pipeline files, made from the nodes that are installed.
#include <cstdio>
#include <nlohmann/json.hpp>

#include "catalogue_text.hpp"
#include "command_options.hpp"
#include "commands.hpp"
#include "marrow/base/text_file.hpp"

namespace marrow::cli {
namespace {

using Json = nlohmann::ordered_json;

Json scalar_schema(const OptionInfo& option) {
  // For every type of option, the value may be the name of an input ("$case").
  const Json name = {{"type", "string"}, {"pattern", "\\$"}};
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
  return {{"anyOf", {value, name}}};
}

Json option_schema(const OptionInfo& option) {
  Json schema = scalar_schema(option);
  if (option.type == OptionType::numbers || option.type == OptionType::texts || option.type == OptionType::paths) {
    schema = {{"type", "array"}, {"items", schema}};
    if (option.length) schema["minItems"] = schema["maxItems"] = option.length;
  }
  schema["description"] = option.help + " (" + range_text(option) + ")";
  if (!option.required) std::visit([&](const auto& value) { schema["default"] = value; }, option.default_value);
  return schema;
}

Json node_schema(const NodeInfo& node, const Catalogue& catalogue) {
  Json with = {{"type", "object"}, {"additionalProperties", false}, {"properties", Json::object()}};
  Json required = Json::array();
  for (const OptionInfo& option : node.options) {
    with["properties"][option.name] = option_schema(option);
    if (option.required) required.push_back(option.name);
  }
  if (!required.empty()) with["required"] = required;
  const Json reference = {{"type", "string"}};
  Json in = {{"type", "object"}, {"additionalProperties", false}, {"properties", Json::object()}};
  for (const KindPort& port : catalogue.ports_of_kind(node.kind()))
    in["properties"][port.name] = {{"description", port_text(port) + (port.help.empty() ? "" : ": " + port.help)},
                                   {"anyOf", {reference, {{"type", "array"}, {"items", reference}}}}};
  Json wired = Json::array();
  for (const PortInfo& port : node.inputs)
    if (!port.optional) wired.push_back(port.name);
  Json properties = {{"uses", {{"const", node.name}, {"description", node.summary}}}, {"with", with}, {"in", in}};
  Json schema = {{"properties", properties}};
  Json needs = Json::array();
  if (!required.empty()) needs.push_back("with");
  if (!wired.empty()) {
    schema["properties"]["in"]["required"] = wired;
    needs.push_back("in");
  }
  if (!needs.empty()) schema["required"] = needs;
  return {{"if", {{"required", {"uses"}}, {"properties", {{"uses", {{"const", node.name}}}}}}}, {"then", schema}};
}

Json pipeline_schema(const Catalogue& catalogue) {
  Json uses = Json::array(), conditions = Json::array();
  for (const std::string& name : catalogue.node_names()) {
    uses.push_back({{"const", name}, {"description", catalogue.find(name)->summary}});
    conditions.push_back(node_schema(*catalogue.find(name), catalogue));
  }
  const Json place = {{"type", "string"}};
  const Json node = {
      {"type", "object"},
      {"anyOf", {{{"required", {"uses"}}}, {{"required", {"repeat"}}}}},
      {"additionalProperties", false},
      {"properties",
       {{"uses", {{"description", "kind.name of the node"}, {"oneOf", uses}}},
        {"with", {{"type", "object"}, {"description", "options"}}},
        {"in", {{"type", "object"}, {"description", "port: node, node.output or node.output.item"}}},
        {"may_fail",
         {{"type", "boolean"},
          {"default", false},
          {"description", "whether the run goes on without the node's outputs if it fails"}}},
        {"repeat",
         {{"description", "the body that is run again and again: a pipeline file, or nodes and outputs"},
          {"anyOf", {place, {{"$ref", "#/definitions/body"}}}}}},
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
  const Json input = {
      {"type", "object"},
      {"additionalProperties", false},
      {"properties",
       {{"type", {{"enum", {"path", "text", "number", "integer", "boolean"}}, {"description", "type of its values"}}},
        {"default",
         {{"type", {"string", "number", "boolean"}},
          {"description", "its value if none is given; without it, one must be given"}}},
        {"help", {{"type", "string"}, {"description", "what it means, for those who give it"}}}}}};
  const Json inputs = {{"type", "object"},
                       {"description", "values that are given on the command line as name=value; $name stands for one"},
                       {"additionalProperties", input}};
  const Json nodes = {{"type", "object"},
                      {"description", "the nodes by their names, in any order"},
                      {"additionalProperties", {{"$ref", "#/definitions/node"}}}};
  const Json outputs = {{"type", "object"},
                        {"description", "what is computed and written: name of the output, and node or node.output"},
                        {"additionalProperties", place}};
  return {{"$schema", "http://json-schema.org/draft-07/schema#"},
          {"title", "marrow pipeline"},
          {"type", "object"},
          {"required", {"marrow", "nodes", "outputs"}},
          {"additionalProperties", false},
          {"definitions",
           {{"node", node},
            {"body",
             {{"type", "object"},
              {"required", {"nodes", "outputs"}},
              {"additionalProperties", false},
              {"properties", {{"inputs", inputs}, {"nodes", nodes}, {"outputs", outputs}}}}}}},
          {"properties",
           {{"marrow", {{"const", 1}, {"description", "version of the format"}}},
            {"name",
             {{"type", "string"},
              {"description", "of the folder that a run writes, runs/NAME (default: the file's name)"}}},
            {"help", {{"type", "string"}, {"description", "what the pipeline does, and for which data"}}},
            {"only_inside",
             {{"type", "boolean"},
              {"description", "no command runs it, but the program itself, so no file need hold its outputs"}}},
            {"inputs", inputs},
            {"nodes", nodes},
            {"outputs", outputs}}}};
}

int schema(const std::filesystem::path& file) {
  const std::string text = pipeline_schema(Catalogue()).dump(1) + "\n";
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
      app.add_subcommand("schema", "print the JSON Schema of pipelines, by which editors complete and check");
  command->add_option("--out", *file, "write it to this file; one that is there is replaced");
  command->callback([file, &code] { code = schema(*file); });
  say_that_libraries_are_described(command);
}

}  // namespace marrow::cli
