// SPDX-License-Identifier: Apache-2.0
#include "workbench/workbench.hpp"

#include <algorithm>

#include "commands.hpp"
#include "marrow/base/error.hpp"
#include "marrow/base/json_text.hpp"
#include "marrow/runtime/pipeline/one_node.hpp"
#include "marrow/runtime/pipeline/pipeline_names.hpp"
#include "new/templates.hpp"
#include "report/report.hpp"

namespace marrow::workbench {

std::filesystem::path workbench_pipeline(const std::string& name) {
  return cli::shared_files(std::filesystem::path("pipelines/workbench") / (name + ".yaml"));
}

std::string set_text(const nlohmann::json& value) {
  std::string text;
  for (const char c : json_text(value)) text += c == '$' ? "$$" : std::string(1, c);
  return text;
}

std::string command_of(const PipelineCall& call) {
  std::string command = "marrow run " + cli::shell_path(call.file);
  const auto add = [&](const std::string& before, const std::string& word) {
    command += before + cli::shell_word(word);
  };
  for (const InputValue& input : call.arguments.inputs) add(" ", input.name + "=" + input.value);
  for (const Override& one : call.arguments.overrides) add(" --set ", one.key + "=" + one.value);
  for (const std::string& output : call.only) add(" --only ", output);
  return command;
}

std::string command_of(const NodeCall& call) {
  PipelineCall shown{.file = workbench_pipeline("node"), .arguments = {{}, {{"node.uses", call.name}}}};
  for (const auto& [option, value] : call.options)
    shown.arguments.overrides.push_back({"node." + option, set_text(value)});
  return command_of(shown);
}

std::string command_in_folder(const Workbench& workbench, const std::string& command) {
  return "cd " + cli::shell_path(workbench.folder.path()) + " && marrow " + command;
}

namespace {

std::map<std::string, Value> outputs_of(const Pipeline& pipeline, RunSettings settings, const Workbench& workbench,
                                        Job& job) {
  settings.cancelled = &job.stopped();
  settings.observer = [&](const RunEvent& event) { job.tell(cli::json_of(event)); };
  settings.remember = false;
  const RunResult result = run_pipeline(pipeline, workbench.catalogue, settings);
  for (std::size_t i = 0; i < result.nodes.size(); ++i)
    if (result.nodes[i].status == NodeRecord::Status::failed)
      throw Error(pipeline.nodes[i].id + " (" + pipeline.nodes[i].info.name + "): " + result.nodes[i].reason);
  if (result.cancelled()) throw Error("stopped");
  std::map<std::string, Value> outputs;
  for (const PipelineOutput& output : pipeline.outputs) outputs[output.name] = value_of(result, output.source);
  return outputs;
}

}  // namespace

std::map<std::string, Value> outputs_of(const PipelineCall& call, const Workbench& workbench, Job& job) {
  Diagnostics diagnostics;
  Pipeline pipeline = read_pipeline(call.file, call.arguments, workbench.catalogue, diagnostics);
  if (!diagnostics.empty()) throw Error(diagnostics.text());
  if (!call.only.empty())
    std::erase_if(pipeline.outputs, [&](const PipelineOutput& output) { return !contains(call.only, output.name); });
  RunSettings settings;
  settings.given = call.given;
  if (call.keep) settings.store = workbench.usable_store();
  return outputs_of(pipeline, settings, workbench, job);
}

std::map<std::string, Value> outputs_of(const NodeCall& call, const Workbench& workbench, Job& job) {
  std::vector<std::pair<std::string, std::string>> options;
  for (const auto& [name, value] : call.options) options.emplace_back(name, set_text(value));
  Diagnostics diagnostics;
  const OneNode one = pipeline_of_node(call.name, {}, options, workbench.catalogue, diagnostics);
  if (!diagnostics.empty()) throw Error(diagnostics.text());
  return outputs_of(one.pipeline, {}, workbench, job);
}

}  // namespace marrow::workbench
