// SPDX-License-Identifier: Apache-2.0
// Runs a graph: starts each node when its sources have ended, on one pool of threads. Also plans what a run would do.
#include "marrow/runtime/run/graph_run.hpp"

#include "marrow/base/process_tree.hpp"
#include "marrow/runtime/run/passes.hpp"
#include "marrow/runtime/run/replay.hpp"
#include "marrow/runtime/store/digest_memory.hpp"

namespace marrow {

using Status = NodeRecord::Status;

namespace {

/// Sets `stopped` of each node that failed or was cancelled: how many of the nodes that depend on it were not called at
/// all. A node that depends on several of them counts for each.
void count_stopped_nodes(const Pipeline& pipeline, std::vector<NodeRecord>& records) {
  for (std::size_t cause = 0; cause < records.size(); ++cause) {
    if (records[cause].status != Status::failed && records[cause].status != Status::cancelled) continue;
    std::vector<bool> is_behind(records.size(), false);
    is_behind[cause] = true;
    for (std::size_t node = cause + 1; node < records.size(); ++node) {  // sources come before users
      for (const Wire& wire : pipeline.nodes[node].wires)
        for (const Reference& source : wire.sources)
          if (source.node >= 0 && is_behind[std::size_t(source.node)]) is_behind[node] = true;
      if (is_behind[node] && records[node].was_stopped()) ++records[cause].stopped;
    }
  }
}

}  // namespace

GraphRun::GraphRun(const Pipeline& pipeline, const Catalogue& catalogue, const RunSettings& settings)
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

GraphRun::~GraphRun() = default;

void GraphRun::begin(tbb::task_arena& arena, std::function<void()> on_end) {
  arena_ = &arena;
  std::vector<std::size_t> ready;
  for (std::size_t i = 0; i < pipeline_.nodes.size(); ++i) {
    if (!needed_[i]) continue;
    ++unfinished_;
    states_[i].waiting_for = count_sources(i);
    if (states_[i].waiting_for == 0) ready.push_back(i);
  }
  if (ready.empty() && on_end) return on_end();
  on_end_ = std::move(on_end);
  ++at_work_;  // so that the end does not come before all have been started
  try {
    for (std::size_t i : ready) enqueue([this, i] { start_node(i); });
  } catch (...) {
    set_fault();
  }
  end_work();
}

const RunResult& GraphRun::result() const {
  if (fault_) std::rethrow_exception(fault_);
  return result_;
}

RunResult GraphRun::finish() {
  if (fault_) std::rethrow_exception(fault_);
  arena_->execute([&] { make_outputs(); });
  count_stopped_nodes(pipeline_, result_.nodes);
  result_.seconds = seconds_since(start_);
  return std::move(result_);
}

std::vector<PlannedNode> GraphRun::plan(bool with_reasons) {
  std::vector<PlannedNode> planned(pipeline_.nodes.size());
  for (std::size_t i = 0; i < pipeline_.nodes.size(); ++i)
    if (needed_[i]) planned[i] = plan_node(i, planned, with_reasons);
  return planned;
}

/// Data made outside of a run has no key yet. Without keys, all such data would count as the same.
void GraphRun::complete_key(Value& value) {
  for (Value& item : value.items) complete_key(item);
  if (value.data && value.type.content && value.key == Digest{}) value.key = KnownKeys::all().key_of(value);
}

/// Makes the data of the pipeline's outputs while the nodes can still be called.
void GraphRun::make_outputs() {
  for (const PipelineOutput& output : pipeline_.outputs) {
    NodeRecord& record = result_.nodes[std::size_t(output.source.node)];
    const PipelineNode& node = pipeline_.node_of(output.source);
    const std::string& wanted = pipeline_.output_of(output.source).type.id;
    const auto type = [&]() -> const TypeInfo& {
      for (const PortInfo& port : catalogue_.load(node.info.name).info.outputs)
        if (port.type.id == wanted) return port.type;
      throw Error("values of type '" + wanted + "' are not known here");
    };
    if (!record.outputs.empty()) Evaluation::make(record.outputs[std::size_t(output.source.output)], type);
  }
}

PlannedNode GraphRun::plan_node(std::size_t index, const std::vector<PlannedNode>& planned, bool with_reasons) {
  const PipelineNode& node = pipeline_.nodes[index];
  PlannedNode result;
  for (const Wire& wire : node.wires)
    for (const Reference& source : wire.sources) {
      const PlannedNode& from = planned[std::size_t(source.node)];
      if (from.what == PlannedNode::What::runs) result.waits_for.insert(pipeline_.node_of(source).id);
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
  plan_calls(index, with_reasons, result);
  if (result.calls_to_make)
    result.what = PlannedNode::What::runs;
  else
    assemble(index);
  return result;
}

void GraphRun::plan_calls(std::size_t index, bool with_reasons, PlannedNode& result) {
  const PipelineNode& node = pipeline_.nodes[index];
  for (Call& call : states_[index].calls) {
    if (!obstacle(node, call, call.result.status).empty()) continue;
    if (node.repetition) {
      Passes(*this, index, call).plan(result);
      continue;
    }
    ++result.calls;
    if (evaluation_.find(index, call)) {
      if (call.result.is_deferred) result.what = PlannedNode::What::function;
      continue;
    }
    ++result.calls_to_make;
    if (with_reasons && result.why.empty())
      result.why = (call.item.empty() ? "" : call.item + ": ") + evaluation_.reason_to_run(index, call);
    result.seconds += evaluation_.seconds_last_time(index, call);
  }
}

int GraphRun::count_sources(std::size_t index) const {
  std::vector<int> sources;
  for (const Wire& wire : pipeline_.nodes[index].wires)
    for (const Reference& source : wire.sources)
      if (needed_[std::size_t(source.node)]) sources.push_back(source.node);
  std::sort(sources.begin(), sources.end());
  return int(std::unique(sources.begin(), sources.end()) - sources.begin());
}

/// Gives work to the pool. If a node throws, only that node fails; any other exception ends the run. `always`: the work
/// is done even if the run is ending.
void GraphRun::enqueue(std::function<void()> work, bool always) {
  const auto is_taken = std::make_shared<std::atomic<bool>>(false);
  ++at_work_;
  try {
    arena_->enqueue([this, work = std::move(work), is_taken, always] {
      if (is_taken->exchange(true)) return;
      try {
        if (always || !is_broken_) work();
      } catch (...) {
        set_fault();
      }
      end_work();
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

/// Counts one piece of work as done. If it was the last one, another thread may destroy this run from here on.
void GraphRun::end_work() {
  std::function<void()> end;
  {
    const std::scoped_lock lock(mutex_);
    --at_work_;
    if (is_over()) end = std::exchange(on_end_, nullptr);
    if (at_work_ == 0) all_done_.notify_all();
  }
  if (end) end();
}

void GraphRun::withdraw(std::atomic<bool>& is_taken) {
  if (!is_taken.exchange(true)) --at_work_;
}

void GraphRun::set_fault() {
  const std::scoped_lock lock(mutex_);
  if (!fault_) fault_ = std::current_exception();
  is_broken_ = true;
}

void GraphRun::watch() {
  std::unique_lock lock(mutex_);
  while (!all_done_.wait_for(lock, std::chrono::milliseconds(20), [&] { return is_over(); })) {
    sample_memory();
    if (settings_.profile.profile) settings_.profile.profile->sample();
  }
}

void GraphRun::sample_memory() {
  const double memory = resident_memory_mb();
  for (std::size_t i = 0; i < states_.size(); ++i)
    if (states_[i].running) result_.nodes[i].peak_memory_mb = std::max(result_.nodes[i].peak_memory_mb, memory);
}

void GraphRun::start_node(std::size_t index) {
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
    if (cancelled()) {
      state.calls[0].result = {Status::cancelled, error.what(), {}};
    } else {
      evaluation_.note_failure(index, "", error.what(), 0, {});
      state.calls[0].result = evaluation_.failure(index, "", error.what());
    }
    finish_node(index);
    return;
  }
  const std::size_t count = state.calls.size();  // the last call that ends clears the calls
  state.unfinished = count;
  for (std::size_t c = 0; c < count; ++c) enqueue([this, index, c] { evaluate(index, c); });
}

void GraphRun::evaluate(std::size_t index, std::size_t c) {
  Call& call = states_[index].calls[c];
  if (is_left_out(index, call)) {
    call.result.status = Status::not_run;
    return finish_call(index, call);
  }
  call.result.reason = obstacle(pipeline_.nodes[index], call, call.result.status);
  if (!call.result.reason.empty()) {
    if (call.result.status == Status::failed) call.result = evaluation_.failure(index, call.item, call.result.reason);
    finish_call(index, call);
    return;
  }
  if (pipeline_.nodes[index].repetition) {
    states_[index].passes = std::make_unique<Passes>(*this, index, call);
    return states_[index].passes->begin();
  }
  evaluation_.evaluate(index, call);
}

/// A replay makes one call only of its node.
bool GraphRun::is_left_out(std::size_t index, const Call& call) const {
  const Replay* replay = settings_.replay;
  return replay && replay->within == settings_.within && replay->node == pipeline_.nodes[index].id &&
         !evaluation_.is_replayed(index, call.item);
}

void GraphRun::finish_call(std::size_t index, Call& call) {
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
void GraphRun::finish_node(std::size_t index) {
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

void GraphRun::assemble(std::size_t index) {
  const PipelineNode& node = pipeline_.nodes[index];
  for (std::size_t output = 0; output < node.info.outputs.size(); ++output)
    result_.nodes[index].outputs.push_back(output_of(node, states_[index], output));
}

bool GraphRun::uses(std::size_t user, std::size_t index) const {
  for (const Wire& wire : pipeline_.nodes[user].wires)
    for (const Reference& source : wire.sources)
      if (source.node == int(index)) return true;
  return false;
}

}  // namespace marrow
