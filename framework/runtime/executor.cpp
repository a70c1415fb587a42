// SPDX-License-Identifier: Apache-2.0
#include "marrow/runtime/executor.hpp"

#include <oneapi/tbb/global_control.h>
#include <oneapi/tbb/task_arena.h>

#include <algorithm>
#include <chrono>
#include <condition_variable>
#include <fstream>
#include <map>
#include <mutex>
#include <opencv2/core/utility.hpp>
#include <thread>

#include <unistd.h>

#include "keys.hpp"
#include "mapping.hpp"

namespace marrow {
namespace {

using Clock = std::chrono::steady_clock;
using Status = NodeRecord::Status;

double seconds_since(Clock::time_point start) { return std::chrono::duration<double>(Clock::now() - start).count(); }

double resident_memory_mb() {
  std::ifstream stream("/proc/self/statm");
  double total = 0, resident = 0;
  stream >> total >> resident;
  return resident * double(sysconf(_SC_PAGESIZE)) / 1e6;
}

/// What one call of a node gave.
struct CallResult {
  Status status = Status::done;
  std::string reason;
  std::vector<Value> outputs;
};

/// One position along the mapped axes of a node.
struct Call {
  std::vector<Value> inputs;
  std::string item;
  CallResult result;
};

class Executor {
 public:
  Executor(const Pipeline& pipeline, const Catalogue& catalogue, const RunSettings& settings)
      : pipeline_(pipeline), catalogue_(catalogue), settings_(settings),
        needed_(pipeline.needed([&](const std::string& id) { return settings.given.count(id) > 0; })), states_(pipeline.nodes.size()) {
    result_.nodes.resize(pipeline.nodes.size());
  }

  RunResult run() {
    // The pool is the only source of threads: OpenCV's own loops stay on the thread of the node that calls them.
    cv::setNumThreads(1);
    const int threads = settings_.threads > 0 ? settings_.threads : int(std::max(1u, std::thread::hardware_concurrency()));
    tbb::global_control limit(tbb::global_control::max_allowed_parallelism, std::size_t(threads) + 1);
    tbb::task_arena arena(threads, 0);
    arena_ = &arena;
    for (std::size_t i = 0; i < pipeline_.nodes.size(); ++i) {
      const auto given = settings_.given.find(pipeline_.nodes[i].id);
      if (given != settings_.given.end()) {
        result_.nodes[i].outputs = given->second;
        for (Value& value : result_.nodes[i].outputs) complete_key(value);
      }
      if (!needed_[i]) continue;
      ++unfinished_;
      states_[i].waiting_for = count_sources(i);
    }
    std::vector<std::size_t> ready;
    for (std::size_t i = 0; i < pipeline_.nodes.size(); ++i)
      if (needed_[i] && states_[i].waiting_for == 0) ready.push_back(i);
    for (std::size_t i : ready) arena.enqueue([this, i] { start_node(i); });
    watch();
    arena.terminate();
    result_.seconds = seconds_since(start_);
    return std::move(result_);
  }

 private:
  struct NodeState {
    int waiting_for = 0;
    std::vector<Call> calls;
    std::vector<std::vector<std::string>> names;  ///< along each mapped axis
    std::size_t unfinished = 0;
    bool running = false;
  };
  /// The result of a recipe: in the making until `done`, then shared by all calls with the same key.
  struct Memo {
    bool done = false;
    CallResult result;
    std::vector<std::pair<std::size_t, std::size_t>> waiting;  ///< (node, call)
  };

  /// Data made outside a run has no key yet; without one, all of it would pass for the same.
  static void complete_key(Value& value) {
    for (Value& item : value.items) complete_key(item);
    if (value.data && value.hash && value.key == Digest{}) value.key = value.hash(value.data.get());
  }

  int count_sources(std::size_t index) const {
    std::vector<int> sources;
    for (const Wire& wire : pipeline_.nodes[index].wires)
      for (const Reference& source : wire.sources)
        if (needed_[std::size_t(source.node)]) sources.push_back(source.node);
    std::sort(sources.begin(), sources.end());
    return int(std::unique(sources.begin(), sources.end()) - sources.begin());
  }

  /// The main thread samples memory until all nodes have ended.
  void watch() {
    std::unique_lock lock(mutex_);
    while (!all_done_.wait_for(lock, std::chrono::milliseconds(20), [&] { return unfinished_ == 0; })) sample_memory();
  }

  void sample_memory() {
    const double memory = resident_memory_mb();
    for (std::size_t i = 0; i < states_.size(); ++i)
      if (states_[i].running) result_.nodes[i].peak_memory_mb = std::max(result_.nodes[i].peak_memory_mb, memory);
  }

  bool cancelled() const { return settings_.cancelled && settings_.cancelled->load(); }

  void report(RunEvent::Kind kind, std::size_t index, const std::string& item, std::string text, double fraction = 0, double seconds = 0) {
    if (!settings_.observer) return;
    const std::scoped_lock lock(observer_mutex_);
    settings_.observer({kind, pipeline_.nodes[index].id, item, std::move(text), fraction, seconds});
  }

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
      if (!cancelled()) report(RunEvent::Kind::failed, index, "", failure_text(index, state.calls[0], error.what()));
      finish_node(index);
      return;
    }
    state.unfinished = state.calls.size();
    for (std::size_t c = 0; c < state.calls.size(); ++c) arena_->enqueue([this, index, c] { evaluate(index, c); });
  }

  /// Gathers the inputs and spreads them over the mapped axes.
  void make_calls(std::size_t index) {
    const PipelineNode& node = pipeline_.nodes[index];
    NodeState& state = states_[index];
    std::vector<Value> inputs(node.info.inputs.size());
    for (const Wire& wire : node.wires) inputs[std::size_t(wire.port)] = wired_value(wire, node.info.inputs[std::size_t(wire.port)]);
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
          throw Error("inputs '" + first + "' and '" + node.info.inputs[i].name + "' do not go in step along '" + axis + "': the first has " +
                      list_text(names) + ", the second " + list_text(along));
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
        if (node.info.inputs[i].axis != node.mapped_axes[depth]) slice[i] = sliced(slice[i], node.mapped_axes[depth], k);
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
        if (!value->missing.empty()) return "its input '" + port.name + "' is missing: " + value->missing;
        status = Status::skipped;
        if (!port.optional) return "there is no '" + port.name + "'";
      }
    }
    return "";
  }

  void evaluate(std::size_t index, std::size_t c) {
    const PipelineNode& node = pipeline_.nodes[index];
    Call& call = states_[index].calls[c];
    call.result.reason = obstacle(node, call, call.result.status);
    if (!call.result.reason.empty()) {
      finish_call(index, c);
      return;
    }
    call.result.status = Status::done;
    const Digest recipe = recipe_of(node, call.inputs);
    const Digest key = result_key(recipe, catalogue_.library_of(node.info.name)->build_id, node.info.random, settings_.seed);
    switch (claim(key, index, c)) {
      case Claim::mine:
        call.result = perform(index, call, recipe, key);
        share(key, call.result);
        finish_call(index, c);
        break;
      case Claim::made: finish_call(index, c); break;
      case Claim::in_the_making: break;  // finished by whoever makes it
    }
  }

  enum class Claim { mine, made, in_the_making };
  /// What has the same key is computed once within a run.
  Claim claim(const Digest& key, std::size_t index, std::size_t c) {
    const std::scoped_lock lock(mutex_);
    const auto [memo, is_first] = memos_.try_emplace(key);
    if (is_first) {
      ++result_.nodes[index].calls;
      return Claim::mine;
    }
    if (!memo->second.done) {
      memo->second.waiting.emplace_back(index, c);
      return Claim::in_the_making;
    }
    states_[index].calls[c].result = memo->second.result;
    return Claim::made;
  }

  void share(const Digest& key, const CallResult& result) {
    std::vector<std::pair<std::size_t, std::size_t>> waiting;
    {
      const std::scoped_lock lock(mutex_);
      Memo& memo = memos_[key];
      memo.done = true;
      memo.result = result;
      waiting.swap(memo.waiting);
    }
    for (const auto& [node, call] : waiting) {
      states_[node].calls[call].result = result;
      finish_call(node, call);
    }
  }

  CallResult perform(std::size_t index, const Call& call, const Digest& recipe, const Digest& key) {
    const PipelineNode& node = pipeline_.nodes[index];
    CallResult result;
    const Clock::time_point start = Clock::now();
    report(RunEvent::Kind::started, index, call.item, "");
    try {
      if (cancelled()) throw Cancelled();
      const NodeDefinition& definition = catalogue_.load(node.info.name);
      const std::shared_ptr<void> options = definition.make_options();
      for (std::size_t i = 0; i < node.options.size(); ++i) definition.set_option[i](options.get(), node.options[i]);
      Context context = make_context(index, call, seed_of(recipe, settings_.seed));
      // Isolated, so that a thread that waits inside this node does not take up another node's work and stretch its time.
      result.outputs = tbb::this_task_arena::isolate([&] { return definition.call(call.inputs, options.get(), context); });
      for (std::size_t i = 0; i < result.outputs.size(); ++i) finish_value(result.outputs[i], key, i, call);
      report(RunEvent::Kind::finished, index, call.item, "", 1, seconds_since(start));
    } catch (const Cancelled&) {
      result.status = Status::cancelled;
      result.reason = "stopped before it was done";
    } catch (const std::bad_alloc&) {
      result.status = Status::failed;
      result.reason = "out of memory";
    } catch (const std::exception& error) {
      result.status = Status::failed;
      result.reason = error.what();
    }
    if (result.status == Status::failed) report(RunEvent::Kind::failed, index, call.item, failure_text(index, call, result.reason));
    const std::scoped_lock lock(mutex_);
    result_.nodes[index].seconds += seconds_since(start);
    sample_memory();
    return result;
  }

  Context make_context(std::size_t index, const Call& call, std::uint64_t seed) {
    Context::Hooks hooks;
    hooks.seed = seed;
    hooks.cancelled = settings_.cancelled;
    hooks.progress = [this, index, item = call.item](double fraction, std::string_view what) {
      report(RunEvent::Kind::progress, index, item, std::string(what), fraction);
    };
    hooks.log = [this, index, item = call.item](std::string_view text, bool is_warning) {
      report(is_warning ? RunEvent::Kind::warning : RunEvent::Kind::message, index, item, std::string(text));
    };
    return Context(std::move(hooks));
  }

  /// Gives data its content hash; gives a function its recipe's key and keeps its inputs alive as long as it.
  static void finish_value(Value& value, const Digest& key, std::size_t output, const Call& call) {
    for (Value& item : value.items) finish_value(item, key, output, call);
    if (value.is_absent() || value.is_list()) return;
    if (value.hash) {
      value.key = value.hash(value.data.get());
      return;
    }
    Hasher hasher;
    hasher.add(key);
    hasher.add(std::uint64_t(output));
    value.key = hasher.digest();
    struct Holder {
      std::shared_ptr<const void> function;
      std::vector<Value> inputs;
    };
    const auto holder = std::make_shared<Holder>(Holder{value.data, call.inputs});
    value.data = std::shared_ptr<const void>(holder, value.data.get());
  }

  std::string failure_text(std::size_t index, const Call& call, const std::string& reason) const {
    const PipelineNode& node = pipeline_.nodes[index];
    std::string text = "node '" + node.id + "' (" + node.info.name + ")";
    if (!call.item.empty()) text += " for " + call.item;
    text += " failed: " + reason;
    std::string inputs;
    for (const Wire& wire : node.wires) {
      inputs += (inputs.empty() ? "" : ", ") + node.info.inputs[std::size_t(wire.port)].name + " = ";
      for (std::size_t i = 0; i < wire.sources.size(); ++i) inputs += (i ? " + " : "") + wire.sources[i].text;
    }
    return inputs.empty() ? text : text + " (its inputs: " + inputs + ")";
  }

  void finish_call(std::size_t index, std::size_t c) {
    const CallResult& result = states_[index].calls[c].result;
    if (result.status == Status::skipped) report(RunEvent::Kind::skipped, index, states_[index].calls[c].item, result.reason);
    bool last = false;
    {
      const std::scoped_lock lock(mutex_);
      last = --states_[index].unfinished == 0;
    }
    if (last) finish_node(index);
  }

  /// Builds the node's outputs from its calls and starts what waited for it.
  void finish_node(std::size_t index) {
    const PipelineNode& node = pipeline_.nodes[index];
    NodeState& state = states_[index];
    NodeRecord& record = result_.nodes[index];
    record.status = Status::done;
    for (const Call& call : state.calls) {
      // The worst of its calls is the node's status; `failed` outranks what follows from other failures.
      static constexpr Status kOrder[] = {Status::failed, Status::cancelled, Status::not_run, Status::skipped};
      for (Status status : kOrder)
        if (call.result.status == status && rank(status) > rank(record.status)) {
          record.status = status;
          record.reason = (call.item.empty() ? "" : call.item + ": ") + call.result.reason;
        }
    }
    for (std::size_t output = 0; output < node.info.outputs.size(); ++output) {
      std::size_t next = 0;
      record.outputs.push_back(assembled(index, output, 0, next));
    }
    std::vector<std::size_t> ready;
    {
      const std::scoped_lock lock(mutex_);
      state.running = false;
      for (std::size_t user = 0; user < pipeline_.nodes.size(); ++user)
        if (needed_[user] && uses(user, index) && --states_[user].waiting_for == 0) ready.push_back(user);
    }
    for (std::size_t user : ready) arena_->enqueue([this, user] { start_node(user); });
    state.calls.clear();
    const std::scoped_lock lock(mutex_);
    if (--unfinished_ == 0) all_done_.notify_all();
  }

  static int rank(Status status) {
    switch (status) {
      case Status::failed: return 4;
      case Status::cancelled: return 3;
      case Status::not_run: return 2;
      case Status::skipped: return 1;
      default: return 0;
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
      for (std::size_t k = 0; k < list.names.size(); ++k) list.items.push_back(assembled(index, output, depth + 1, next));
      return list;
    }
    const CallResult& result = state.calls[next++].result;
    if (result.status == Status::done) return result.outputs[output];
    Value absent;
    absent.type = node.info.outputs[output].type;
    if (result.status == Status::failed) absent.missing = "node '" + node.id + "' failed";
    else if (result.status != Status::skipped) absent.missing = result.reason;
    return absent;
  }

  const Pipeline& pipeline_;
  const Catalogue& catalogue_;
  const RunSettings& settings_;
  std::vector<bool> needed_;
  std::vector<NodeState> states_;
  std::map<Digest, Memo> memos_;
  RunResult result_;
  std::size_t unfinished_ = 0;
  std::mutex mutex_, observer_mutex_;
  std::condition_variable all_done_;
  tbb::task_arena* arena_ = nullptr;
  Clock::time_point start_ = Clock::now();
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
  return std::any_of(nodes.begin(), nodes.end(), [](const NodeRecord& node) { return node.status == Status::cancelled; });
}

Value value_of(const RunResult& result, const Reference& source) {
  const NodeRecord& node = result.nodes[std::size_t(source.node)];
  if (node.outputs.empty()) return {};
  Value value = node.outputs[std::size_t(source.output)];
  for (const std::string& item : source.items) value = picked(value, item, source.text);
  return value;
}

RunResult run_pipeline(const Pipeline& pipeline, const Catalogue& catalogue, const RunSettings& settings) {
  return Executor(pipeline, catalogue, settings).run();
}

}  // namespace marrow
