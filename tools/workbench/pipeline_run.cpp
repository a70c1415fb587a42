// SPDX-License-Identifier: Apache-2.0
#include "workbench/pipeline_run.hpp"

#include "commands.hpp"
#include "marrow/base/error.hpp"
#include "marrow/base/number_text.hpp"
#include "marrow/runtime/run/place_of_results.hpp"
#include "marrow/runtime/run/run_folder.hpp"
#include "marrow/runtime/run/verdict_json.hpp"

namespace marrow::workbench {
namespace {

using nlohmann::json;
using Kind = RunEvent::Kind;

/// The lines that `marrow run` writes to the log of a run.
void log_event(RunLog& log, const RunEvent& event) {
  const std::string where = cli::place_of(event);
  if (event.kind == Kind::finished) {
    const std::string text = formatted("{:.3f} s", event.seconds);
    log.keep(LogLevel::info, where, text);
  } else if (event.kind == Kind::skipped) {
    log.keep(LogLevel::info, where, "skipped: " + event.text);
  } else if (event.kind == Kind::warning) {
    log.keep(LogLevel::warning, where, event.text);
  } else if (event.kind == Kind::failed) {
    log.keep(event.level, "", event.text);
  } else if (event.kind == Kind::message) {
    log.keep(event.level, where, event.text);
  }
}

json nodes_of(const Pipeline& pipeline, const RunResult& result) {
  json nodes = json::object();
  for (std::size_t i = 0; i < result.nodes.size(); ++i)
    nodes[pipeline.nodes[i].id] = {{"status", status_name(result.nodes[i].status)},
                                   {"reason", result.nodes[i].reason},
                                   {"seconds", result.nodes[i].seconds}};
  return nodes;
}

}  // namespace

void LastRuns::keep(const std::string& file, std::shared_ptr<const LastRun> run) {
  const std::lock_guard lock(mutex_);
  file_ = file;
  run_ = std::move(run);
}

std::shared_ptr<const LastRun> LastRuns::find(const std::string& file, const std::string& revision,
                                              const json& inputs) const {
  const std::lock_guard lock(mutex_);
  return run_ && file_ == file && run_->revision == revision && run_->inputs == inputs ? run_ : nullptr;
}

json plan_of(const Pipeline& pipeline, const Workbench& workbench) {
  RunSettings settings;
  settings.store = workbench.usable_store();
  if (!settings.store)
    throw Error("results cannot be kept, so it is not known what is stale: " + workbench.store.fault());
  settings.remember = false;
  return cli::json_of(pipeline, plan_pipeline(pipeline, workbench.catalogue, settings));
}

json run_into_folder(std::shared_ptr<LastRun> run, const PipelineArguments& arguments, const Workbench& workbench,
                     Job& job) {
  cli::expect_files_can_hold(run->pipeline, workbench.catalogue);
  const std::filesystem::path runs = workbench.folder.inside("runs");
  expect_nothing_reads(run->pipeline, runs, "the folder of the runs", "open a folder above it");
  RunSettings settings;
  settings.store = workbench.usable_store();
  if (settings.store)
    expect_nothing_reads(run->pipeline, settings.store->folder(), "the store of results",
                         "set MARROW_CACHE to another folder");
  RunFolder folder = RunFolder::with_free_name(runs / run->pipeline.name, run->pipeline);
  for (const std::string& note : run->pipeline.notes) folder.log().keep(LogLevel::info, "", "note: " + note);
  settings.cancelled = &job.stopped();
  settings.observer = [&](const RunEvent& event) {
    log_event(folder.log(), event);
    job.tell(cli::json_of(event));
  };
  folder.keep_failed_calls(settings, workbench.catalogue);
  run->result = run_pipeline(run->pipeline, workbench.catalogue, settings);
  const auto written =
      folder.write_outputs(run->pipeline, run->result, workbench.catalogue, recipe_of_run(run->pipeline, settings));
  folder.write_record(run->pipeline, run->result, settings, workbench.catalogue, arguments, written);
  if (settings.store) settings.store->tidy(settings.cancelled);
  json verdicts = json::array(), faults = json::array();
  for (const NamedVerdict& one : verdicts_of(run->pipeline, run->result)) verdicts.push_back(json_of(one));
  for (const RunFolder::Written& output : written)
    if (!output.fault.empty()) faults.push_back("output '" + output.output + "': " + output.fault);
  return {{"folder", workbench.folder.relative(folder.path())},
          {"status", run->result.cancelled() ? "cancelled"
                     : run->result.failed()  ? "failed"
                                             : "done"},
          {"seconds", run->result.seconds},
          {"verdicts", verdicts},
          {"faults", faults},
          {"nodes", nodes_of(run->pipeline, run->result)}};
}

}  // namespace marrow::workbench
