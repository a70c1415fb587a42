// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <oneapi/tbb/task_arena.h>

#include <atomic>
#include <condition_variable>
#include <exception>
#include <functional>
#include <memory>
#include <mutex>
#include <vector>

#include "marrow/runtime/run/node_calls.hpp"

namespace marrow {

class Passes;

/// One run of a graph on a pool of threads: each node starts when its sources have ended. The pipeline and the settings
/// must outlive it.
class GraphRun {
 public:
  GraphRun(const Pipeline& pipeline, const Catalogue& catalogue, const RunSettings& settings);
  ~GraphRun();

  /// Starts the nodes that wait for no other. `on_end` is called once, by a thread of the pool, when all work has
  /// ended. It must not destroy the run itself.
  void begin(tbb::task_arena& arena, std::function<void()> on_end = {});
  /// Waits for the end, and samples memory meanwhile. Not to be called by a thread of the pool.
  void watch();
  /// The result of a run that has ended, with the data of the pipeline's outputs. Throws what ended it, if that was no
  /// failure of a node.
  RunResult finish();
  /// What the run would do. Outputs of cached nodes are then in result().
  /// `with_reasons`: says why nodes run.
  std::vector<PlannedNode> plan(bool with_reasons);
  /// The result so far. Its outputs may have no data yet. Throws as finish() does.
  const RunResult& result() const;

 private:
  friend class Passes;
  struct NodeState : NodeCalls {
    int waiting_for = 0;
    std::size_t unfinished = 0;
    bool running = false;
    std::unique_ptr<Passes> passes;
  };

  static void complete_key(Value& value);
  void make_outputs();
  PlannedNode plan_node(std::size_t index, const std::vector<PlannedNode>& planned, bool with_reasons);
  void plan_calls(std::size_t index, bool with_reasons, PlannedNode& result);
  int count_sources(std::size_t index) const;
  void enqueue(std::function<void()> work, bool always = false);
  void withdraw(std::atomic<bool>& is_taken);
  void end_work();
  void set_fault();
  bool is_over() const { return (unfinished_ == 0 || is_broken_) && at_work_ == 0; }
  void sample_memory();
  bool cancelled() const { return settings_.cancelled && settings_.cancelled->load(); }
  void start_node(std::size_t index);
  void evaluate(std::size_t index, std::size_t c);
  bool is_left_out(std::size_t index, const Call& call) const;
  void finish_call(std::size_t index, Call& call);
  void finish_node(std::size_t index);
  void assemble(std::size_t index);
  bool uses(std::size_t user, std::size_t index) const;

  const Pipeline& pipeline_;
  const Catalogue& catalogue_;
  const RunSettings& settings_;
  std::vector<bool> needed_;
  std::vector<NodeState> states_;
  RunResult result_;
  std::size_t unfinished_ = 0;
  std::mutex mutex_;
  std::condition_variable all_done_;
  std::function<void()> on_end_;
  std::atomic<int> at_work_{0};
  std::atomic<bool> is_broken_{false};
  std::exception_ptr fault_;
  tbb::task_arena* arena_ = nullptr;
  Clock::time_point start_ = Clock::now();
  Evaluation evaluation_;
};

}  // namespace marrow
