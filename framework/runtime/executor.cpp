// SPDX-License-Identifier: Apache-2.0
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
#include "mapping.hpp"
#include "no_process.hpp"
#include "stopped_nodes.hpp"
#include "thread_supply.hpp"

namespace marrow {
namespace {

using Clock = std::chrono::steady_clock;
using Status = NodeRecord::Status;

double seconds_since(Clock::time_point start) { return std::chrono::duration<double>(Clock::now() - start).count(); }

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
    // The pool is the only source of threads: OpenCV's own loops stay on the thread of the node that calls them.
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
  struct NodeState {
    int waiting_for = 0;
    std::vector<Call> calls;
    std::vector<std::vector<std::string>> names;  ///< along each mapped axis
    std::size_t unfinished = 0;
    bool running = false;
  };
  /// Data made outside a run has no key yet; without one, all of it would pass for the same.
  static void complete_key(Value& value) {
    for (Value& item : value.items) complete_key(item);
    if (value.data && value.type.content && value.key == Digest{})
      value.key = value.type.content->hash(value.data.get());
  }

  /// What the pipeline is to give is made while the nodes can still be called.
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
    make_calls(index);
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

  /// Gives the pool some work. What a node throws is its own failure; anything else that goes wrong ends the run.
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
    } catch (const std::bad_alloc&) {  // no memory for it: nobody will be at it
      withdraw(*is_taken);
      throw;
    } catch (const std::exception& error) {  // no thread for it: in this process TBB waits for that thread from now on
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

  /// The main thread samples memory until all nodes have ended, and nothing of the run is at work any more.
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
      make_calls(index);
    } catch (const std::exception& error) {
      state.names.assign(pipeline_.nodes[index].mapped_axes.size(), {""});
      state.calls.assign(1, {});
      state.calls[0].result.status = cancelled() ? Status::cancelled : Status::failed;
      state.calls[0].result.reason = error.what();
      if (!cancelled())
        evaluation_.report(RunEvent::Kind::failed, index, "", evaluation_.failure_text(index, "", error.what()));
      finish_node(index);
      return;
    }
    const std::size_t count = state.calls.size();  // the last of them to end clears the calls
    state.unfinished = count;
    for (std::size_t c = 0; c < count; ++c) enqueue([this, index, c] { evaluate(index, c); });
  }

  /// Gathers the inputs and spreads them over the mapped axes.
  void make_calls(std::size_t index) {
    const PipelineNode& node = pipeline_.nodes[index];
    NodeState& state = states_[index];
    std::vector<Value> inputs(node.info.inputs.size());
    for (const Wire& wire : node.wires)
      inputs[std::size_t(wire.port)] = wired_value(wire, node.info.inputs[std::size_t(wire.port)]);
    std::vector<std::string> names_text;
    for (const std::string& axis : node.mapped_axes) {
      std::vector<std::string> names;
      std::string first;
      for (std::size_t i = 0; i < inputs.size(); ++i) {
        if (node.info.inputs[i].axis == axis) continue;  // consumed whole
        const std::vector<std::string> along = names_along(inputs[i], axis);
        if (along.empty()) continue;
        if (names.empty()) {
          names = along;
          first = node.info.inputs[i].name;
        } else if (names != along) {
          throw Error("inputs '" + first + "' and '" + node.info.inputs[i].name + "' do not go in step along '" + axis +
                      "': the first has " + list_text(names) + ", the second " + list_text(along));
        }
      }
      if (names.empty()) names = {""};  // its list is absent as a whole
      state.names.push_back(std::move(names));
    }
    spread(index, inputs, 0, "");
  }

  static std::string list_text(const std::vector<std::string>& names) {
    std::string text;
    for (const std::string& name : names) text += (text.empty() ? "" : ", ") + name;
    return "(" + text + ")";
  }

  void spread(std::size_t index, const std::vector<Value>& inputs, std::size_t depth, const std::string& item) {
    const PipelineNode& node = pipeline_.nodes[index];
    NodeState& state = states_[index];
    if (depth == node.mapped_axes.size()) {
      state.calls.push_back({inputs, item, {}});
      return;
    }
    for (std::size_t k = 0; k < state.names[depth].size(); ++k) {
      std::vector<Value> slice = inputs;
      for (std::size_t i = 0; i < slice.size(); ++i)
        if (node.info.inputs[i].axis != node.mapped_axes[depth])
          slice[i] = sliced(slice[i], node.mapped_axes[depth], k);
      spread(index, slice, depth + 1, item.empty() ? state.names[depth][k] : item + "/" + state.names[depth][k]);
    }
  }

  Value wired_value(const Wire& wire, const PortInfo& port) const {
    if (!wire.is_list_literal) {
      Value value = value_of(result_, wire.sources[0]);
      const std::vector<std::string> axes = pipeline_.axes_of(wire.sources[0]);
      const bool has_axis = std::find(axes.begin(), axes.end(), port.axis) != axes.end();
      return port.axis.empty() || has_axis ? value : as_list_of_one(value, wire.sources[0], port.axis);
    }
    Value list;
    list.axis = port.axis;
    for (const Reference& source : wire.sources) {
      list.items.push_back(value_of(result_, source));
      list.type = list.items.back().type;
      list.names.push_back(short_name(source));
    }
    return list;
  }

  std::string short_name(const Reference& source) const {
    return source.items.empty() ? pipeline_.nodes[std::size_t(source.node)].id : source.items.back();
  }

  /// A list port may be given one item, which then is a list of one; inside other axes, at their ends.
  Value as_list_of_one(const Value& value, const Reference& source, const std::string& axis) const {
    Value result = value;
    if (value.is_list()) {
      for (Value& item : result.items) item = as_list_of_one(item, source, axis);
      return result;
    }
    if (value.is_absent()) return value;
    Value list;
    list.type = value.type;
    list.axis = axis;
    list.names = {short_name(source)};
    list.items = {value};
    return list;
  }

  /// Why a call cannot be made, or an empty text. Sets `skipped` where an input simply is not there.
  static std::string obstacle(const PipelineNode& node, const Call& call, Status& status) {
    for (std::size_t i = 0; i < call.inputs.size(); ++i) {
      const PortInfo& port = node.info.inputs[i];
      std::vector<const Value*> leaves{&call.inputs[i]};
      for (std::size_t k = 0; k < leaves.size(); ++k) {
        const Value* value = leaves[k];
        for (const Value& item : value->items) leaves.push_back(&item);
        if (!value->is_absent()) continue;
        status = Status::not_run;
        if (!value->missing.empty()) return value->missing;  // the first cause, however far off
        status = Status::skipped;
        if (!port.optional) return "there is no '" + port.name + "'";
      }
    }
    return "";
  }

  void evaluate(std::size_t index, std::size_t c) {
    Call& call = states_[index].calls[c];
    call.result.reason = obstacle(pipeline_.nodes[index], call, call.result.status);
    if (!call.result.reason.empty()) {
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

  /// Builds the node's outputs from its calls and starts what waited for it.
  void finish_node(std::size_t index) {
    NodeState& state = states_[index];
    NodeRecord& record = result_.nodes[index];
    // A node all of whose calls are deferred is not needed until something that runs asks for what it makes.
    const bool deferred = !state.calls.empty() && std::all_of(state.calls.begin(), state.calls.end(),
                                                              [](const Call& call) { return call.result.is_deferred; });
    record.status = deferred ? Status::not_needed : Status::done;
    for (const Call& call : state.calls) {
      // The worst of its calls is the node's status; `failed` outranks what follows from other failures.
      static constexpr Status kOrder[] = {Status::failed, Status::cancelled, Status::not_run, Status::skipped};
      for (Status status : kOrder)
        if (call.result.status == status && rank(status) > rank(record.status)) {
          record.status = status;
          record.reason = (call.item.empty() ? "" : call.item + ": ") + call.result.reason;
        }
    }
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
    for (std::size_t output = 0; output < pipeline_.nodes[index].info.outputs.size(); ++output) {
      std::size_t next = 0;
      result_.nodes[index].outputs.push_back(assembled(index, output, 0, next));
    }
  }

  static int rank(Status status) {
    switch (status) {
      case Status::failed:
        return 4;
      case Status::cancelled:
        return 3;
      case Status::not_run:
        return 2;
      case Status::skipped:
        return 1;
      default:
        return 0;
    }
  }

  bool uses(std::size_t user, std::size_t index) const {
    for (const Wire& wire : pipeline_.nodes[user].wires)
      for (const Reference& source : wire.sources)
        if (source.node == int(index)) return true;
    return false;
  }

  Value assembled(std::size_t index, std::size_t output, std::size_t depth, std::size_t& next) {
    const PipelineNode& node = pipeline_.nodes[index];
    const NodeState& state = states_[index];
    if (depth < state.names.size() && !(state.names[depth].size() == 1 && state.names[depth][0].empty())) {
      Value list;
      list.type = node.info.outputs[output].type;
      list.axis = node.mapped_axes[depth];
      list.names = state.names[depth];
      for (std::size_t k = 0; k < list.names.size(); ++k)
        list.items.push_back(assembled(index, output, depth + 1, next));
      return list;
    }
    const CallResult& result = state.calls[next++].result;
    if (result.status == Status::done) return result.outputs[output];
    Value absent;
    absent.type = node.info.outputs[output].type;
    if (result.status == Status::failed)
      absent.missing = "node '" + node.id + "' failed";
    else if (result.status != Status::skipped)
      absent.missing = result.reason;
    return absent;
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

const char* status_name(Status status) {
  static constexpr const char* kNames[] = {"not needed", "done", "skipped", "failed", "not run", "cancelled"};
  return kNames[int(status)];
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

std::vector<PlannedNode> plan_pipeline(const Pipeline& pipeline, const Catalogue& catalogue,
                                       const RunSettings& settings) {
  return Executor(pipeline, catalogue, settings).plan();
}

RunResult run_pipeline(const Pipeline& pipeline, const Catalogue& catalogue, const RunSettings& settings) {
  return Executor(pipeline, catalogue, settings).run();
}

}  // namespace marrow
