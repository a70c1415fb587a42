// SPDX-License-Identifier: Apache-2.0
#pragma once
// Calls of nodes in a process of their own: those that parse files which come from outside.
#include <nlohmann/json_fwd.hpp>

#include "marrow/runtime/catalogue.hpp"
#include "marrow/runtime/context.hpp"
#include "marrow/runtime/executor.hpp"

namespace marrow {

class WorkerReports;
struct WorkerEnd;

/// Whether calls of the node run apart: its kind says so, an option of it names a file, and no function goes in or
/// comes out.
bool runs_apart(const PipelineNode& node);

/// What one call may use.
struct CallLimits {
  double memory_mb = 0;
  double processor_s = 0;
  double seconds = 0;  ///< by the clock
  int threads = 1;
};

/// By the bytes that the node's paths name and that go in as values; `settings` may replace them.
CallLimits limits_of(const PipelineNode& node, double bytes, const RunSettings& settings);

/// Calls the node in a worker that does nothing else. What it reports goes to the context's hooks. Throws Error,
/// Cancelled or std::bad_alloc as the node itself would; an Error that names the file where the process crashed or went
/// beyond its limits.
std::vector<Value> call_apart(const Catalogue& catalogue, const PipelineNode& node, const std::vector<Value>& inputs,
                              const Context::Hooks& hooks, const RunSettings& settings);

/// Why the file could not be read by the process that ended so, as a sentence.
std::string failure_of(const std::string& file, const WorkerEnd& end, const CallLimits& limits);

/// The worker's side: {"do": "call", "library": ..., "node": ..., "options": ..., ...}. Inputs come by descriptor 3,
/// outputs go to descriptor 4.
nlohmann::json answer_call(const nlohmann::json& request, WorkerReports& reports);

/// {"do": "share"}: what the last call made, all of it in the memory of descriptor 4.
nlohmann::json answer_share(const nlohmann::json& request, WorkerReports& reports);
/// {"do": "describe", "library": ...}: the library's manifest, as a text.
nlohmann::json answer_describe(const nlohmann::json& request, WorkerReports& reports);

}  // namespace marrow
