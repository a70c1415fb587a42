// SPDX-License-Identifier: Apache-2.0
// Calls a node: makes its inputs, checks what it leaves behind, and keeps its result.
#include <oneapi/tbb/task_arena.h>

#include <algorithm>
#include <csignal>
#include <opencv2/core.hpp>
#include <optional>

#include "marrow/base/process_tree.hpp"
#include "marrow/runtime/pipeline/named_files.hpp"
#include "marrow/runtime/plugins/python_file.hpp"
#include "marrow/runtime/run/apart.hpp"
#include "marrow/runtime/run/evaluation.hpp"
#include "marrow/runtime/run/output_faults.hpp"
#include "marrow/runtime/run/replay.hpp"
#include "marrow/runtime/store/shared_store.hpp"

namespace marrow {
namespace {

using Status = NodeRecord::Status;

void expect_sound(const std::vector<Value>& outputs, const std::vector<PortInfo>& ports) {
  for (std::size_t i = 0; i < outputs.size(); ++i)
    for_leaves(outputs[i], [&](const Value& leaf) {
      std::string fault = fault_of_value(leaf);
      if (fault.empty()) fault = fault_of_figures(ports.at(i), leaf);
      if (!fault.empty()) throw Error("it gave an output '" + ports.at(i).name + "' that cannot be: " + fault);
    });
}

/// Sets the key of a value: the content hash of data, or the key of a function, which is made from the recipe. A
/// function also keeps the node's inputs alive.
void finish_value(Value& value, const Digest& key, std::size_t output, const std::vector<Value>& inputs) {
  for (Value& item : value.items) finish_value(item, key, output, inputs);
  if (value.is_absent() || value.is_list()) return;
  if (!value.type.is_function) {
    value.key = value.type.content->hash(value.data.get());
    return;
  }
  value.key = function_key(key, output);
  struct Holder {
    std::shared_ptr<const void> function;
    std::vector<Value> inputs;
  };
  const auto holder = std::make_shared<Holder>(Holder{value.data, inputs});
  value.data = std::shared_ptr<const void>(holder, value.data.get());
}

/// Whether a stored value has the type and the axis of the output. The entry may come from another build or be damaged.
bool is_of(const Value& value, const PortInfo& output) {
  if (value.type != output.type || (value.is_list() && value.axis != output.axis)) return false;
  if (!output.axis.empty() && !value.is_list()) return value.is_absent();
  return std::all_of(value.items.begin(), value.items.end(),
                     [&](const Value& item) { return item.type == output.type && !item.is_list(); });
}

}  // namespace

CallResult Evaluation::perform(std::size_t node, std::vector<Value> inputs, const std::string& item,
                               const Recipe& recipe) {
  const Profile::Bar bar(settings_.profile, Profile::Kind::node, pipeline_.nodes[node].id, item);
  CallResult result;
  std::vector<std::string> warnings;
  const Clock::time_point start = Clock::now();
  double seconds = 0;
  bool is_own = true;
  try {
    if (settings_.cancelled && settings_.cancelled->load()) throw Cancelled();
    const Digest before = states_of_files(pipeline_.nodes[node]);
    write_back_files(pipeline_.nodes[node]);
    // Isolated: a thread that waits inside this node must not take up work of another node, because that would add to
    // the time of this node.
    result.outputs = tbb::this_task_arena::isolate([&] { return call_node(node, inputs, item, recipe, warnings); });
    expect_sound(result.outputs, pipeline_.nodes[node].info.outputs);
    check_unchanged(node, inputs, recipe, before);
    seconds = seconds_since(start);
    for (std::size_t i = 0; i < result.outputs.size(); ++i) finish_value(result.outputs[i], recipe.key, i, inputs);
    if (settings_.profile.profile)
      for (Value& output : result.outputs) show_calls(output, settings_.profile, pipeline_.nodes[node].id, item);
    report(RunEvent::Kind::finished, node, item, "", 1, seconds);
  } catch (const MissingInput& missing) {
    result.status = missing.status;
    result.reason = missing.missing;
  } catch (const Cancelled&) {
    result.status = Status::cancelled;
    result.reason = "stopped before it was done";
  } catch (const std::bad_alloc&) {
    result.status = Status::failed;
    result.reason = "out of memory";
  } catch (const cv::Exception& error) {
    result.status = Status::failed;
    result.reason = error.code == cv::Error::StsNoMem ? "out of memory" : error.what();
  } catch (const NoProcess& error) {
    is_own = false;
    result.status = Status::failed;
    result.reason = error.what();
  } catch (...) {
    result.status = Status::failed;
    result.reason = reason_of_exception();
  }
  const bool is_failed = result.status == Status::failed;
  if (is_failed) note_failure(node, item, result.reason, seed_of_call(node, item, recipe), inputs);
  if (is_failed) result = failure(node, item, result.reason, is_own);
  if (!is_failed && is_replayed(node, item)) end_replay(node, result, seconds);
  if (result.status == Status::done) save(node, item, inputs, recipe, result, seconds, std::move(warnings));
  const std::scoped_lock lock(mutex_);
  NodeRecord& record = records_[node];
  record.seconds += seconds_since(start);
  ++record.calls;
  record.peak_memory_mb = std::max(record.peak_memory_mb, resident_memory_mb());
  if (record.status == Status::not_needed || (record.status == Status::done && result.status != Status::done)) {
    record.status = result.status;
    record.reason = result.reason;
  }
  return result;
}

/// The content that was read must be the content that the key covers. Otherwise the store would keep a wrong result for
/// ever. A file that was changed and changed back is noticed, too: its state is another one.
void Evaluation::check_unchanged(std::size_t node, const std::vector<Value>& inputs, const Recipe& recipe,
                                 const Digest& states) const {
  const std::vector<std::string> paths = paths_of(pipeline_.nodes[node]);
  if (paths.empty()) return;
  if (states_of_files(pipeline_.nodes[node]) != states || recipe_of(pipeline_.nodes[node], inputs) != recipe.recipe)
    throw Error(paths[0] + (paths.size() > 1 ? " or another file of the node" : "") +
                " changed while it was read; run it again");
}

void Evaluation::make_inputs(const NodeDefinition& definition, std::vector<Value>& inputs) {
  for (std::size_t i = 0; i < inputs.size(); ++i)
    for_leaves(inputs[i], [&](Value& leaf) {
      if (leaf.data || !leaf.source) return;
      const TypeInfo& type = definition.info.inputs[i].type;
      leaf.data = leaf.source->data(type);
      leaf.type.content = type.content;  // what is read back does not know it, and another process may need it
    });
}

/// A replayed call has the seed that it had, also if the node has got a new option since.
std::uint64_t Evaluation::seed_of_call(std::size_t node, const std::string& item, const Recipe& recipe) const {
  if (is_replayed(node, item) && settings_.replay->seed) return *settings_.replay->seed;
  return seed_of(recipe.recipe, settings_.seed);
}

std::vector<Value> Evaluation::call_node(std::size_t node, std::vector<Value>& inputs, const std::string& item,
                                         const Recipe& recipe, std::vector<std::string>& warnings) {
  const PipelineNode& called = pipeline_.nodes[node];
  const Replay* replay = is_replayed(node, item) ? settings_.replay : nullptr;
  const bool apart = runs_apart(called) && !is_python_plugin(catalogue_.library_of(called.info.name)->file) &&
                     !(replay && replay->in_this_process);
  if (!apart || !inputs.empty()) make_inputs(catalogue_.load(called.info.name), inputs);
  report(RunEvent::Kind::started, node, item, "");
  if (replay && replay->on_begin) replay->on_begin(called, inputs);
  const Context::Hooks hooks = make_hooks(node, item, seed_of_call(node, item, recipe), warnings);
  if (apart) return call_apart(catalogue_, called, inputs, hooks, settings_);
  const NodeDefinition& definition = catalogue_.load(called.info.name);
  const std::shared_ptr<void> options = definition.make_options();
  for (std::size_t i = 0; i < called.options.size(); ++i) definition.set_option[i](options.get(), called.options[i]);
  std::vector<Value> outputs;
  state_->keep_during([&] {
    Context context(hooks);
    if (replay && replay->stops_before) std::raise(SIGTRAP);  // the next step enters the node
    outputs = definition.call(inputs, options.get(), context);
  });
  return outputs;
}

void Evaluation::save(std::size_t node, const std::string& item, const std::vector<Value>& inputs, const Recipe& recipe,
                      const CallResult& result, double seconds, std::vector<std::string> warnings) {
  const std::vector<PortInfo>& outputs = pipeline_.nodes[node].info.outputs;
  if (!settings_.store || recipe.is_kept ||
      std::any_of(outputs.begin(), outputs.end(), [](const PortInfo& output) { return output.type.is_function; }))
    return;
  // It depends on files that its key does not cover. The next run knows them.
  if (!is_fully_described(*catalogue_.library_of(pipeline_.nodes[node].info.name))) return;
  const Profile::Bar bar(settings_.profile, Profile::Kind::store, pipeline_.nodes[node].id, item, "keeps the result");
  Provenance made_from = provenance(node, inputs);
  made_from.seconds = seconds;
  made_from.warnings = std::move(warnings);
  const std::string fault = settings_.store->save(recipe.key, result.outputs, made_from);
  if (SharedStore* shared = shared_for(node)) shared->offer(recipe.key, result.outputs, made_from);
  if (fault.empty()) return;
  {
    const std::scoped_lock lock(mutex_);
    if (std::exchange(store_complained_, true)) return;
  }
  report(RunEvent::Kind::warning, node, "", "results are not kept: " + fault);
}

Context::Hooks Evaluation::make_hooks(std::size_t node, const std::string& item, std::uint64_t seed,
                                      std::vector<std::string>& warnings) {
  Context::Hooks hooks;
  hooks.seed = seed;
  hooks.cancelled = settings_.cancelled;
  hooks.progress = [this, node, item](double fraction, std::string_view what) {
    report(RunEvent::Kind::progress, node, item, std::string(what), fraction);
  };
  hooks.log = [this, node, item, &warnings](std::string_view text, LogLevel level) {
    const bool is_warning = level == LogLevel::warning;
    if (is_warning) {
      const std::scoped_lock lock(warnings_mutex_);
      warnings.emplace_back(text);
    }
    report(is_warning ? RunEvent::Kind::warning : RunEvent::Kind::message, node, item, std::string(text), 0, 0, level);
  };
  return hooks;
}

/// A call that is made when its result is first needed.
class Evaluation::Deferred {
 public:
  Deferred(Evaluation& evaluation, std::size_t node, const Call& call, const Recipe& recipe)
      : evaluation_(evaluation), node_(node), inputs_(call.inputs), item_(call.item), recipe_(recipe) {}

  const CallResult& result() {
    // The thread that holds the lock runs isolated, so it never comes back here for the same call.
    const std::scoped_lock lock(mutex_);
    if (!result_) result_ = evaluation_.perform(node_, inputs_, item_, recipe_);
    return *result_;
  }
  void drop_stored() const { evaluation_.settings_.store->drop(recipe_.key); }
  Profile::Bar bar(const char* what) const {
    return Profile::Bar(evaluation_.settings_.profile, Profile::Kind::store, node_id(), item_, what);
  }
  const std::string& node_id() const { return evaluation_.pipeline_.nodes[node_].id; }

 private:
  Evaluation& evaluation_;
  std::size_t node_;
  std::vector<Value> inputs_;
  std::string item_;
  Recipe recipe_;
  std::mutex mutex_;
  std::optional<CallResult> result_;
};

/// One leaf of the result of a deferred call. It is read from the store if it is there and whole.
class Evaluation::DeferredSource : public Source {
 public:
  DeferredSource(std::shared_ptr<Deferred> call, std::size_t leaf, std::shared_ptr<Source> stored = nullptr)
      : call_(std::move(call)), leaf_(leaf), stored_(std::move(stored)) {}

  std::shared_ptr<const void> data(const TypeInfo& type) override {
    if (stored_) {
      const Profile::Bar bar = call_->bar("reads the result");
      try {
        return stored_->data(type);
      } catch (const DamagedEntry&) {
        call_->drop_stored();  // the result can be made again from its recipe
      }
    }
    const CallResult& result = call_->result();
    if (result.status == Status::failed_alone)
      throw Error("node '" + call_->node_id() + "' failed, and its result in the store is damaged; run it again");
    if (result.status == Status::failed) throw MissingInput{Status::not_run, "node '" + call_->node_id() + "' failed"};
    if (result.status != Status::done) throw MissingInput{result.status, result.reason};
    std::size_t at = 0;
    std::shared_ptr<const void> data;
    for (const Value& output : result.outputs)
      for_leaves(output, [&](const Value& leaf) {
        if (at++ == leaf_) data = leaf.data;
      });
    if (!data) throw MissingInput{Status::not_run, "node '" + call_->node_id() + "' made none"};
    return data;
  }

 private:
  std::shared_ptr<Deferred> call_;
  std::size_t leaf_;
  std::shared_ptr<Source> stored_;
};

void Evaluation::defer(std::size_t node, Call& call, const Recipe& recipe) {
  const auto deferred = std::make_shared<Deferred>(*this, node, call, recipe);
  call.result = {Status::done, "", {}, true, false};
  const std::vector<PortInfo>& outputs = pipeline_.nodes[node].info.outputs;
  for (std::size_t i = 0; i < outputs.size(); ++i) {
    Value value;
    value.type = outputs[i].type;
    value.key = function_key(recipe.key, i);
    value.source = std::make_shared<DeferredSource>(deferred, i);
    call.result.outputs.push_back(std::move(value));
  }
}

bool Evaluation::read_back(std::size_t node, Call& call, const Recipe& recipe, Where where) {
  if (!settings_.store || settings_.made_anew.contains(pipeline_.nodes[node].id)) return false;
  Profile::Bar bar(settings_.profile, Profile::Kind::cached, pipeline_.nodes[node].id, call.item);
  std::optional<StoredResult> stored = settings_.store->find(recipe.key, where);
  const std::vector<PortInfo>& outputs = pipeline_.nodes[node].info.outputs;
  if (stored && !std::equal(stored->outputs.begin(), stored->outputs.end(), outputs.begin(), outputs.end(), is_of)) {
    settings_.store->drop(recipe.key);
    stored.reset();
  }
  if (!stored) {
    bar.leave_out();
    return false;
  }
  const auto deferred = std::make_shared<Deferred>(*this, node, call, recipe);
  std::size_t leaf = 0;
  for (Value& output : stored->outputs)
    for_leaves(output, [&](Value& value) {
      if (value.source) value.source = std::make_shared<DeferredSource>(deferred, leaf, value.source);
      ++leaf;
    });
  for (const std::string& warning : stored->provenance.warnings)
    report(RunEvent::Kind::warning, node, call.item, warning_now(warning, pipeline_.nodes[node], stored->provenance));
  report(RunEvent::Kind::cached, node, call.item, "", 1, stored->provenance.seconds);
  call.result = {Status::done, "", std::move(stored->outputs), false, true};
  const std::scoped_lock lock(mutex_);
  ++records_[node].cached;
  records_[node].cached_seconds += stored->provenance.seconds;
  return true;
}

void Evaluation::make(Value& value, const std::function<const TypeInfo&()>& type) {
  for_leaves(value, [&](Value& leaf) {
    if (leaf.data || !leaf.source) return;
    try {
      leaf.data = leaf.source->data(type());
    } catch (const MissingInput& missing) {
      leaf.missing = missing.missing;
    } catch (const std::exception& error) {
      leaf.missing = error.what();
    }
    leaf.source = nullptr;
  });
}

}  // namespace marrow
