// SPDX-License-Identifier: Apache-2.0
// Runs and plans pipelines: makes the pool of threads.
#include "marrow/runtime/run/executor.hpp"

#include <oneapi/tbb/global_control.h>
#include <oneapi/tbb/task_arena.h>

#include <algorithm>
#include <opencv2/core.hpp>
#include <thread>

#include "marrow/base/no_process.hpp"
#include "marrow/base/process_state.hpp"
#include "marrow/base/thread_supply.hpp"
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

}  // namespace marrow
