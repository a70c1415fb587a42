// SPDX-License-Identifier: Apache-2.0
// Runs a pipeline: starts each node when its sources have ended, on one pool of threads. Also plans what a run would
// do.
#include "marrow/runtime/executor.hpp"

#include <oneapi/tbb/global_control.h>
#include <oneapi/tbb/task_arena.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <condition_variable>
#include <exception>
#include <memory>
#include <mutex>
#include <opencv2/core/utility.hpp>
#include <thread>

#include "evaluation.hpp"
#include "no_process.hpp"
#include "node_calls.hpp"
#include "resident_memory.hpp"
#include "stopped_nodes.hpp"
#include "stopwatch.hpp"
#include "thread_supply.hpp"

namespace marrow {
namespace {

using Status = NodeRecord::Status;

class Executor {
 public:
  Executor(const Pipeline& pipeline, const Catalogue& catalogue, const RunSettings& settings)
      : pipeline_(pipeline),
        catalogue_(catalogue),
        settings_(settings),
        needed_(pipeline.needed([&](const std::string& id) { return settings.given.count(id) > 0; })),
        states_(pipeline.nodes.size()),
        evaluation_(pipeline, catalogue, settings, result_.nodes, mutex_,
                    [this](std::size_t node, Call& call) { finish_call(node, call); }) {
    result_.nodes.resize(pipeline.nodes.size());
    for (std::size_t i = 0; i < pipeline.nodes.size(); ++i) {
      const auto given = settings.given.find(pipeline.nodes[i].id);
      if (given == settings.given.end()) continue;
      result_.nodes[i].outputs = given->second;
      for (Value& value : result_.nodes[i].outputs) complete_key(value);
    }
  }

  RunResult run() {
    // The pool is the only source of threads. OpenCV's own loops stay on the thread of the node that calls them.
    cv::setNumThreads(1);
    const int wanted =
        settings_.threads > 0 ? settings_.threads : int(std::max(1u, std::thread::hardware_concurrency()));
    const int threads = threads_to_be_had(wanted);
    if (threads == 0) {
      note_call_without_process();
      throw NoProcess("cannot start a thread; the limit of processes is reached (ulimit -u)");
    }
    tbb::global_control limit(tbb::global_control::max_allowed_parallelism, std::size_t(threads) + 1);
    tbb::task_arena arena(threads, 0);
    arena_ = &arena;
    for (std::size_t i = 0; i < pipeline_.nodes.size(); ++i) {
      if (!needed_[i]) continue;
      ++unfinished_;
      states_[i].waiting_for = count_sources(i);
    }
    std::vector<std::size_t> ready;
    for (std::size_t i = 0; i < pipeline_.nodes.size(); ++i)
      if (needed_[i] && states_[i].waiting_for == 0) ready.push_back(i);
    try {
      for (std::size_t i : ready) enqueue([this, i] { start_node(i); });
    } catch (...) {
      set_fault();
    }
    watch();
    if (fault_) std::rethrow_exception(fault_);
    arena.execute([&] { make_outputs(); });
    arena.terminate();
    count_stopped_nodes(pipeline_, result_.nodes);
    result_.seconds = seconds_since(start_);
    return std::move(result_);
  }

  std::vector<PlannedNode> plan() {
    std::vector<PlannedNode> planned(pipeline_.nodes.size());
    for (std::size_t i = 0; i < pipeline_.nodes.size(); ++i)
      if (needed_[i]) planned[i] = plan_node(i, planned);
    return planned;
  }

 private:
  struct NodeState : NodeCalls {
    int waiting_for = 0;
    std::size_t unfinished = 0;
    bool running = false;
  };
  /// Data made outside of a run has no key yet. Without keys, all such data would count as the same.
  static void complete_key(Value& value) {
    for (Value& item : value.items) complete_key(item);
    if (value.data && value.type.content && value.key == Digest{})
      value.key = value.type.content->hash(value.data.get());
  }

  /// Makes the data of the pipeline's outputs while the nodes can still be called.
  void make_outputs() {
    for (const PipelineOutput& output : pipeline_.outputs) {
      NodeRecord& record = result_.nodes[std::size_t(output.source.node)];
      const PipelineNode& node = pipeline_.nodes[std::size_t(output.source.node)];
      const auto type = [&]() -> const TypeInfo& {
        return catalogue_.load(node.info.name).info.outputs[std::size_t(output.source.output)].type;
      };
      if (!record.outputs.empty()) Evaluation::make(record.outputs[std::size_t(output.source.output)], type);
    }
  }

  PlannedNode plan_node(std::size_t index, const std::vector<PlannedNode>& planned) {
    const PipelineNode& node = pipeline_.nodes[index];
    PlannedNode result;
    for (const Wire& wire : node.wires)
      for (const Reference& source : wire.sources) {
        const PlannedNode& from = planned[std::size_t(source.node)];
        if (from.what == PlannedNode::What::runs) result.waits_for.insert(pipeline_.nodes[std::size_t(source.node)].id);
        if (from.what == PlannedNode::What::depends)
          result.waits_for.insert(from.waits_for.begin(), from.waits_for.end());
      }
    if (!result.waits_for.empty()) {
      result.what = PlannedNode::What::depends;
      return result;
    }
    NodeState& state = states_[index];
    make_calls(pipeline_, result_, index, state);
    result.what = PlannedNode::What::cached;
    for (Call& call : state.calls) {
      if (!obstacle(node, call, call.result.status).empty()) continue;
      ++result.calls;
      if (evaluation_.find(index, call)) {
        if (call.result.is_deferred) result.what = PlannedNode::What::function;
        continue;
      }
      ++result.calls_to_make;
      if (result.why.empty())
        result.why = (call.item.empty() ? "" : call.item + ": ") + evaluation_.change_since_last(index, call);
      result.seconds += evaluation_.seconds_last_time(index, call);
    }
    if (result.calls_to_make)
      result.what = PlannedNode::What::runs;
    else
      assemble(index);
    return result;
  }

  int count_sources(std::size_t index) const {
    std::vector<int> sources;
    for (const Wire& wire : pipeline_.nodes[index].wires)
      for (const Reference& source : wire.sources)
        if (needed_[std::size_t(source.node)]) sources.push_back(source.node);
    std::sort(sources.begin(), sources.end());
    return int(std::unique(sources.begin(), sources.end()) - sources.begin());
  }

  /// Gives work to the pool. If a node throws, only that node fails; any other exception ends the run.
  template <class Work>
  void enqueue(Work work) {
    const auto is_taken = std::make_shared<std::atomic<bool>>(false);
    ++at_work_;
    try {
      arena_->enqueue([this, work, is_taken] {
        if (is_taken->exchange(true)) return;
        try {
          if (!is_broken_) work();
        } catch (...) {
          set_fault();
        }
        const std::scoped_lock lock(mutex_);
        if (--at_work_ == 0) all_done_.notify_all();
      });
    } catch (const std::bad_alloc&) {  // there is no memory: the work will not run
      withdraw(*is_taken);
      throw;
    } catch (const std::exception& error) {  // there is no thread: from now on TBB waits for it in this process
      withdraw(*is_taken);
      note_call_without_process();
      throw NoProcess(std::string("cannot start a thread (") + error.what() +
                      "); the limit of processes is reached (ulimit -u)");
    }
  }

  void withdraw(std::atomic<bool>& is_taken) {
    if (!is_taken.exchange(true)) --at_work_;
  }

  void set_fault() {
    const std::scoped_lock lock(mutex_);
    if (!fault_) fault_ = std::current_exception();
    is_broken_ = true;
  }

  /// The main thread samples memory until all nodes have ended and no work of the run is left.
  void watch() {
    std::unique_lock lock(mutex_);
    const auto is_over = [&] { return (unfinished_ == 0 || is_broken_) && at_work_ == 0; };
    while (!all_done_.wait_for(lock, std::chrono::milliseconds(20), is_over)) sample_memory();
  }

  void sample_memory() {
    const double memory = resident_memory_mb();
    for (std::size_t i = 0; i < states_.size(); ++i)
      if (states_[i].running) result_.nodes[i].peak_memory_mb = std::max(result_.nodes[i].peak_memory_mb, memory);
  }

  bool cancelled() const { return settings_.cancelled && settings_.cancelled->load(); }

  void start_node(std::size_t index) {
    NodeState& state = states_[index];
    NodeRecord& record = result_.nodes[index];
    {
      const std::scoped_lock lock(mutex_);
      record.start_s = seconds_since(start_);
      state.running = true;
      sample_memory();
    }
    try {
      if (cancelled()) throw Cancelled();
      make_calls(pipeline_, result_, index, state);
    } catch (const std::exception& error) {
      state.names.assign(pipeline_.nodes[index].mapped_axes.size(), {""});
      state.calls.assign(1, {});
      if (cancelled())
        state.calls[0].result = {Status::cancelled, error.what(), {}};
      else
        state.calls[0].result = evaluation_.failure(index, "", error.what());
      finish_node(index);
      return;
    }
    const std::size_t count = state.calls.size();  // the last call that ends clears the calls
    state.unfinished = count;
    for (std::size_t c = 0; c < count; ++c) enqueue([this, index, c] { evaluate(index, c); });
  }

  void evaluate(std::size_t index, std::size_t c) {
    Call& call = states_[index].calls[c];
    call.result.reason = obstacle(pipeline_.nodes[index], call, call.result.status);
    if (!call.result.reason.empty()) {
      if (call.result.status == Status::failed) call.result = evaluation_.failure(index, call.item, call.result.reason);
      finish_call(index, call);
      return;
    }
    evaluation_.evaluate(index, call);
  }

  void finish_call(std::size_t index, Call& call) {
    if (call.result.status == Status::skipped)
      evaluation_.report(RunEvent::Kind::skipped, index, call.item, call.result.reason);
    bool last = false;
    {
      const std::scoped_lock lock(mutex_);
      last = --states_[index].unfinished == 0;
    }
    if (last) finish_node(index);
  }

  /// Builds the node's outputs from its calls and starts the nodes that waited for it.
  void finish_node(std::size_t index) {
    NodeState& state = states_[index];
    set_status(state.calls, result_.nodes[index]);
    assemble(index);
    std::vector<std::size_t> ready;
    {
      const std::scoped_lock lock(mutex_);
      state.running = false;
      for (std::size_t user = 0; user < pipeline_.nodes.size(); ++user)
        if (needed_[user] && uses(user, index) && --states_[user].waiting_for == 0) ready.push_back(user);
    }
    for (std::size_t user : ready) enqueue([this, user] { start_node(user); });
    state.calls.clear();
    const std::scoped_lock lock(mutex_);
    --unfinished_;
  }

  void assemble(std::size_t index) {
    const PipelineNode& node = pipeline_.nodes[index];
    for (std::size_t output = 0; output < node.info.outputs.size(); ++output)
      result_.nodes[index].outputs.push_back(output_of(node, states_[index], output));
  }

  bool uses(std::size_t user, std::size_t index) const {
    for (const Wire& wire : pipeline_.nodes[user].wires)
      for (const Reference& source : wire.sources)
        if (source.node == int(index)) return true;
    return false;
  }

  const Pipeline& pipeline_;
  const Catalogue& catalogue_;
  const RunSettings& settings_;
  std::vector<bool> needed_;
  std::vector<NodeState> states_;
  RunResult result_;
  std::size_t unfinished_ = 0;
  std::mutex mutex_;
  std::condition_variable all_done_;
  std::atomic<int> at_work_{0};
  std::atomic<bool> is_broken_{false};
  std::exception_ptr fault_;
  tbb::task_arena* arena_ = nullptr;
  Clock::time_point start_ = Clock::now();
  Evaluation evaluation_;
};

}  // namespace

std::vector<PlannedNode> plan_pipeline(const Pipeline& pipeline, const Catalogue& catalogue,
                                       const RunSettings& settings) {
  return Executor(pipeline, catalogue, settings).plan();
}

RunResult run_pipeline(const Pipeline& pipeline, const Catalogue& catalogue, const RunSettings& settings) {
  return Executor(pipeline, catalogue, settings).run();
}

}  // namespace marrow
