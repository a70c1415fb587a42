// SPDX-License-Identifier: Apache-2.0
// Runs and plans pipelines: makes the pool of threads.
#include "marrow/runtime/run/executor.hpp"

#include <oneapi/tbb/global_control.h>
#include <oneapi/tbb/task_arena.h>

#include <thread>

#include "marrow/base/machine.hpp"
#include "marrow/base/number_text.hpp"
#include "marrow/runtime/run/graph_run.hpp"

namespace marrow {

std::vector<PlannedNode> plan_pipeline(const Pipeline& pipeline, const Catalogue& catalogue,
                                       const RunSettings& settings) {
  return GraphRun(pipeline, catalogue, settings).plan(true);
}

RunResult run_pipeline(const Pipeline& pipeline, const Catalogue& catalogue, const RunSettings& settings) {
  const UsualArithmetic arithmetic;  // the threads of the pool take it over
  GraphRun run(pipeline, catalogue, settings);
  // The pool is the only source of threads. OpenCV's own loops stay on the thread of the node that calls them.
  cv::setNumThreads(1);
  cv::setUseOptimized(true);
  const int wanted = settings.threads > 0 ? settings.threads : int(std::max(1u, std::thread::hardware_concurrency()));
  const int threads = threads_to_be_had(wanted);
  if (threads == 0) {
    note_call_without_process();
    throw NoProcess("cannot start a thread; the limit of processes is reached (ulimit -u)");
  }
  tbb::global_control limit(tbb::global_control::max_allowed_parallelism, std::size_t(threads) + 1);
  tbb::task_arena arena(threads, 0);
  run.begin(arena);
  run.watch();
  RunResult result = run.finish();
  arena.terminate();
  return result;
}

using Status = NodeRecord::Status;

const char* status_name(Status status) {
  static constexpr const char* kNames[] = {"not needed", "done",      "skipped",     "failed",
                                           "not run",    "cancelled", "failed alone"};
  return kNames[int(status)];
}

bool NodeRecord::was_stopped() const { return status == Status::not_run && calls + cached == 0; }

std::string not_run_text(int nodes) {
  return formatted("{} not run because of it", counted(nodes, "node was", "nodes were"));
}

bool RunResult::failed() const {
  return std::any_of(nodes.begin(), nodes.end(), [](const NodeRecord& node) { return node.status == Status::failed; });
}

bool RunResult::cancelled() const {
  return std::any_of(nodes.begin(), nodes.end(),
                     [](const NodeRecord& node) { return node.status == Status::cancelled; });
}

Value value_of(const RunResult& result, const Reference& source) {
  const NodeRecord& node = result.nodes[std::size_t(source.node)];
  if (node.outputs.empty()) return {};
  Value value = node.outputs[std::size_t(source.output)];
  for (const std::string& item : source.items) value = picked(value, item, source.text);
  return value;
}

}  // namespace marrow
