// SPDX-License-Identifier: Apache-2.0
#include "workbench/workbench.hpp"

#include <algorithm>

#include "commands.hpp"
#include "marrow/base/error.hpp"
#include "marrow/runtime/pipeline/pipeline_names.hpp"
#include "new/templates.hpp"
#include "report/report.hpp"

namespace marrow::workbench {

std::filesystem::path workbench_pipeline(const std::string& name) {
  return cli::shared_files(std::filesystem::path("pipelines/workbench") / (name + ".yaml"));
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

std::string command_in_folder(const Workbench& workbench, const std::string& command) {
  return "cd " + cli::shell_path(workbench.folder.path()) + " && marrow " + command;
}

std::map<std::string, Value> outputs_of(const PipelineCall& call, const Workbench& workbench, Job& job) {
  Diagnostics diagnostics;
  Pipeline pipeline = read_pipeline(call.file, call.arguments, workbench.catalogue, diagnostics);
  if (!diagnostics.empty()) throw Error(diagnostics.text());
  if (!call.only.empty())
    std::erase_if(pipeline.outputs, [&](const PipelineOutput& output) { return !contains(call.only, output.name); });
  RunSettings settings;
  settings.cancelled = &job.stopped();
  settings.observer = [&](const RunEvent& event) { job.tell(cli::json_of(event)); };
  settings.given = call.given;
  settings.remember = false;
  if (call.keep) settings.store = workbench.usable_store();
  const RunResult result = run_pipeline(pipeline, workbench.catalogue, settings);
  for (std::size_t i = 0; i < result.nodes.size(); ++i)
    if (result.nodes[i].status == NodeRecord::Status::failed)
      throw Error(pipeline.nodes[i].id + " (" + pipeline.nodes[i].info.name + "): " + result.nodes[i].reason);
  if (result.cancelled()) throw Error("stopped");
  std::map<std::string, Value> outputs;
  for (const PipelineOutput& output : pipeline.outputs) outputs[output.name] = value_of(result, output.source);
  return outputs;
}

}  // namespace marrow::workbench
