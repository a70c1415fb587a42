// SPDX-License-Identifier: Apache-2.0
// Calls a node: makes its inputs, checks what it leaves behind, and keeps its result.
#include <oneapi/tbb/task_arena.h>

#include <algorithm>
#include <csignal>
#include <opencv2/core.hpp>

#include "marrow/base/no_process.hpp"
#include "marrow/base/process_tree.hpp"
#include "marrow/base/reason_of_exception.hpp"
#include "marrow/base/stopwatch.hpp"
#include "marrow/runtime/pipeline/named_files.hpp"
#include "marrow/runtime/plugins/python_file.hpp"
#include "marrow/runtime/run/apart.hpp"
#include "marrow/runtime/run/evaluation.hpp"
#include "marrow/runtime/run/keys.hpp"
#include "marrow/runtime/run/output_faults.hpp"
#include "marrow/runtime/run/profiled_functions.hpp"
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

}  // namespace marrow
