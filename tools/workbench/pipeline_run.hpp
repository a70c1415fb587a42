// SPDX-License-Identifier: Apache-2.0
#pragma once
// Plans and runs a pipeline of the opened folder, as `marrow plan` and `marrow run` do, and shows the outputs of nodes.
#include <mutex>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>

#include "workbench/workbench.hpp"

namespace marrow::workbench {

/// The last run, whose values are still in memory.
struct LastRun {
  std::string revision;  ///< of the pipeline's file
  nlohmann::json inputs;
  Pipeline pipeline;
  RunResult result;
};

/// Keeps the last run. Safe to use from several threads.
class LastRuns {
 public:
  void keep(const std::string& file, std::shared_ptr<const LastRun> run);
  /// Null unless the last run was of this file, revision and inputs.
  std::shared_ptr<const LastRun> find(const std::string& file, const std::string& revision,
                                      const nlohmann::json& inputs) const;

 private:
  mutable std::mutex mutex_;
  std::string file_;
  std::shared_ptr<const LastRun> run_;
};

/// {nodes: {id: {state, text, seconds}}, cached, to_run, may_run, seconds}. `state` is cached, function, runs, depends
/// or not_needed. Throws Error with the faults of the pipeline.
nlohmann::json plan_of(const Pipeline& pipeline, const Workbench& workbench);

/// Runs it into a new folder runs/NAME of the opened folder. Returns {folder, status, seconds, verdicts, faults, nodes:
/// {id: {status, reason, seconds}}}. The job gets the run's events.
nlohmann::json run_into_folder(std::shared_ptr<LastRun> run, const PipelineArguments& arguments,
                               const Workbench& workbench, Job& job);

/// The outputs of a node for the page: [{name, type, help, left_out, items: [{place, parts: [{kind, ...}]}]}]. Takes
/// them from `last` if it has them, otherwise from the store. Throws Error if they have not been computed yet.
nlohmann::json outputs_of_node(const Pipeline& pipeline, const std::string& node, const LastRun* last,
                               const Workbench& workbench, Job& job);

}  // namespace marrow::workbench
