// SPDX-License-Identifier: Apache-2.0
#pragma once
// Calls of nodes in their own process. This is for nodes that parse files which come from outside.
#include <nlohmann/json_fwd.hpp>

#include "marrow/runtime/process/packed_values.hpp"
#include "marrow/runtime/run/executor.hpp"

namespace MARROW_EXPORT marrow {

class Worker;
class WorkerReports;
struct WorkerEnd;

/// Whether calls of the node run in their own process. They do if the node's kind says so, an option of the node names
/// a file, and no input or output is a function.
bool runs_apart(const PipelineNode& node);

/// Limits of one call.
struct CallLimits {
  double memory_mb = 0;
  double processor_s = 0;
  double seconds = 0;  ///< wall time
  int threads = 1;
};

/// The limits for a call. `bytes` is the size of the files that the node's paths name and of its input values.
/// `settings` may replace the limits.
CallLimits limits_of(const PipelineNode& node, double bytes, const RunSettings& settings);

/// Calls the node in a worker that does nothing else. The worker's reports go to the context's hooks. Throws Error if
/// the node fails, and also if the process crashes or exceeds its limits; the Error then names the file. Throws
/// Cancelled, and std::bad_alloc if this process runs out of memory.
std::vector<Value> call_apart(const Catalogue& catalogue, const PipelineNode& node, const std::vector<Value>& inputs,
                              const Context::Hooks& hooks, const RunSettings& settings);

/// An option's value as JSON, for the request of a call.
nlohmann::json json_of_option(const OptionValue& value);

/// Passes a worker's report on: its progress, or a line of the log.
void pass_on(const nlohmann::json& report, const Context& context);

/// The values that a worker has made. Large pieces are read from its memory. If this is not allowed, they are read from
/// memory that both processes share.
std::vector<Value> handed_over(Worker& worker, const SharedMemory& made, const ContentOf& content_of);

/// Throws Error unless the values have the types and axes of the outputs.
void expect_outputs(const std::vector<Value>& values, const std::vector<PortInfo>& outputs);

/// A sentence that says why the file could not be read. `end` is how the process ended.
std::string failure_of(const std::string& file, const WorkerEnd& end, const CallLimits& limits);

/// The worker's side of a call: {"do": "call", "library": ..., "node": ..., "options": ..., ...}. Inputs come through
/// descriptor 3, outputs go to descriptor 4.
nlohmann::json answer_call(const nlohmann::json& request, WorkerReports& reports);

/// {"do": "share"}: writes what the last call made, all of it, to the memory of descriptor 4.
nlohmann::json answer_share(const nlohmann::json& request, WorkerReports& reports);

}  // namespace marrow
