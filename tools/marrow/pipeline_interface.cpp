// SPDX-License-Identifier: Apache-2.0
// What a pipeline takes and gives: `marrow inspect FILE.yaml`, and the inputs in `marrow check`.
#include <cstdio>
#include <nlohmann/json.hpp>

#include "commands.hpp"
#include "marrow/base/error.hpp"
#include "marrow/base/printable.hpp"
#include "marrow/runtime/pipeline/pipeline_names.hpp"

namespace marrow::cli {
namespace {

using nlohmann::json;

/// "number, default 7": what may be given, and what counts otherwise.
std::string value_text(const PipelineInput& input) {
  std::string text = input.type;
  if (!input.over.empty()) text += " for each " + input.over;
  if (input.is_data) return text + (input.is_optional ? ", optional" : "") + "; given by a pipeline that uses this one";
  if (!input.has_default) return text + ", must be given";
  const bool is_text = input.type == "text" || input.type == "path";
  return text + ", default " + (is_text ? in_quotes(input.default_text) : input.default_text);
}

json interface_json(const Pipeline& pipeline) {
  json inputs = json::array(), outputs = json::array();
  for (const PipelineInput& input : pipeline.inputs) {
    json one = {{"name", input.name}, {"type", input.type}, {"help", input.help}};
    if (input.has_default) one["default"] = input.default_text;
    if (!input.over.empty()) one["over"] = input.over;
    if (input.is_data) one["optional"] = input.is_optional;
    inputs.push_back(std::move(one));
  }
  for (const PipelineOutput& output : pipeline.outputs) {
    const PortInfo& port = pipeline.output_of(output.source);
    outputs.push_back({{"name", output.name},
                       {"type", port.type.id},
                       {"axes", pipeline.axes_of(output.source)},
                       {"help", port.help}});
  }
  return {{"name", pipeline.name}, {"help", pipeline.help}, {"inputs", inputs}, {"outputs", outputs}};
}

}  // namespace

void print_inputs(const Pipeline& pipeline) {
  for (const PipelineInput& input : pipeline.inputs)
    std::printf("  input %s (%s)%s%s\n", printable(input.name).c_str(), printable(value_text(input)).c_str(),
                input.help.empty() ? "" : ": ", printable(input.help).c_str());
}

int inspect_pipeline(const std::filesystem::path& file, bool as_json) {
  const Catalogue catalogue;
  Pipeline pipeline;
  if (!load({file, {}, {}}, catalogue, pipeline, false)) return 2;
  if (as_json) {
    print_as_json(interface_json(pipeline));
    return 0;
  }
  std::printf("%s\n", printable(pipeline.name).c_str());
  const std::string help = pipeline.help.substr(0, pipeline.help.find_last_not_of('\n') + 1);
  if (!help.empty()) std::printf("  %s\n", printable(help).c_str());
  std::printf("\n");
  print_inputs(pipeline);
  for (const PipelineOutput& output : pipeline.outputs) {
    const PortInfo& port = pipeline.output_of(output.source);
    const std::vector<std::string> axes = pipeline.axes_of(output.source);
    std::printf("  output %s (%s%s): %s\n", printable(output.name).c_str(), port.type.id.c_str(),
                axes.empty() ? "" : printable(" for each " + joined(axes, " and ")).c_str(),
                printable(port.help).c_str());
  }
  return 0;
}

}  // namespace marrow::cli
