// SPDX-License-Identifier: Apache-2.0
#include "evaluation.hpp"

#include <fcntl.h>
#include <oneapi/tbb/task_arena.h>
#include <unistd.h>

#include <algorithm>
#include <cstdio>
#include <opencv2/core.hpp>
#include <optional>

#include "apart.hpp"
#include "keys.hpp"
#include "mapping.hpp"
#include "named_files.hpp"

namespace marrow {
namespace {

using Clock = std::chrono::steady_clock;
using Status = NodeRecord::Status;

double seconds_since(Clock::time_point start) { return std::chrono::duration<double>(Clock::now() - start).count(); }

/// Calls visit(item) for each single value in `value`, lists taken apart, in order.
template <class V, class Visit>
void for_leaves(V& value, const Visit& visit) {
  if (!value.is_list()) return visit(value);
  for (auto& item : value.items) for_leaves(item, visit);
}

/// Whether a stored value is one that the output gives: by its own account, it may come from another build or be
/// damaged.
bool is_of(const Value& value, const PortInfo& output) {
  if (value.type != output.type || (value.is_list() && value.axis != output.axis)) return false;
  if (!output.axis.empty() && !value.is_list()) return value.is_absent();
  return std::all_of(value.items.begin(), value.items.end(),
                     [&](const Value& item) { return item.type == output.type && !item.is_list(); });
}

/// Thrown where an input cannot be made because its own node failed.
struct MissingInput {
  Status status;
  std::string missing;
};

/// Gives data its content hash; gives a function its recipe's key and keeps its inputs alive as long as it.
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

/// Asks for no memory, for it is called where none may be left.
double resident_memory_mb() {
  const int file = open("/proc/self/statm", O_RDONLY | O_CLOEXEC);
  if (file < 0) return 0;
  char text[100];
  const ssize_t size = read(file, text, sizeof text - 1);
  close(file);
  text[std::max<ssize_t>(size, 0)] = '\0';
  unsigned long resident = 0;
  return std::sscanf(text, "%*u %lu", &resident) == 1 ? double(resident) * double(sysconf(_SC_PAGESIZE)) / 1e6 : 0;
}

/// The result of a recipe: in the making until `done`, then shared by all calls with the same key.
struct Evaluation::Memo {
  bool done = false;
  CallResult result;
  std::vector<std::pair<std::size_t, Call*>> waiting;
};

/// A call that is made when its result is first needed.
class Evaluation::Deferred {
 public:
  Deferred(Evaluation& evaluation, std::size_t node, const Call& call, const Recipe& recipe)
      : evaluation_(evaluation), node_(node), inputs_(call.inputs), item_(call.item), recipe_(recipe) {}

  const CallResult& result() {
    // A thread that holds the lock runs isolated, so it never comes back here for the same call.
    const std::scoped_lock lock(mutex_);
    if (!result_) result_ = evaluation_.perform(node_, inputs_, item_, recipe_);
    return *result_;
  }
  void drop_stored() const { evaluation_.settings_.store->drop(recipe_.key); }
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

/// One leaf of what a deferred call returns; read from the store where it is there and whole.
class Evaluation::DeferredSource : public Source {
 public:
  DeferredSource(std::shared_ptr<Deferred> call, std::size_t leaf, std::shared_ptr<Source> stored = nullptr)
      : call_(std::move(call)), leaf_(leaf), stored_(std::move(stored)) {}

  std::shared_ptr<const void> data(const TypeInfo& type) override {
    if (stored_) {
      try {
        return stored_->data(type);
      } catch (const DamagedEntry&) {
        call_->drop_stored();  // the recipe is known: it is made again
      }
    }
    const CallResult& result = call_->result();
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

Evaluation::Evaluation(const Pipeline& pipeline, const Catalogue& catalogue, const RunSettings& settings,
                       std::vector<NodeRecord>& records, std::mutex& mutex,
                       std::function<void(std::size_t, Call&)> finished)
    : pipeline_(pipeline),
      catalogue_(catalogue),
      settings_(settings),
      records_(records),
      mutex_(mutex),
      finished_(std::move(finished)) {}
Evaluation::~Evaluation() = default;

void Evaluation::report(RunEvent::Kind kind, std::size_t node, const std::string& item, std::string text,
                        double fraction, double seconds) const {
  if (!settings_.observer) return;
  const std::scoped_lock lock(observer_mutex_);
  settings_.observer({kind, pipeline_.nodes[node].id, item, std::move(text), fraction, seconds});
}

Evaluation::Recipe Evaluation::recipe(std::size_t node, const Call& call, Contents* contents) const {
  const NodeInfo& info = pipeline_.nodes[node].info;
  const Digest recipe = recipe_of(pipeline_.nodes[node], call.inputs, contents);
  return {recipe, result_key(recipe, catalogue_.library_of(info.name)->build_id, info.random, settings_.seed)};
}

/// The record of the run tells what its files held when they were read, whatever becomes of them later.
Evaluation::Recipe Evaluation::noted_recipe(std::size_t node, const Call& call) {
  const auto note = [&](const Contents& contents) {
    const std::scoped_lock lock(mutex_);
    if (!contents.empty() || records_[node].files.empty())
      records_[node].files = contents_of_options(pipeline_.nodes[node], contents);
  };
  Contents contents;
  note(contents);
  const Recipe key = recipe(node, call, &contents);
  files_read_.note(contents);
  note(contents);
  return key;
}

bool Evaluation::makes_functions(std::size_t node) const {
  const std::vector<PortInfo>& outputs = pipeline_.nodes[node].info.outputs;
  return std::all_of(outputs.begin(), outputs.end(),
                     [](const PortInfo& output) { return output.type.is_function && output.axis.empty(); });
}

void Evaluation::evaluate(std::size_t node, Call& call) {
  Recipe key;
  try {
    key = noted_recipe(node, call);
    remember(node, call, key);
  } catch (const std::exception& error) {  // a file that its options name cannot be read
    call.result = {Status::failed, error.what(), {}};
    report(RunEvent::Kind::failed, node, call.item, failure_text(node, call.item, error.what()));
    return finished_(node, call);
  }
  {
    const std::scoped_lock lock(mutex_);
    std::unique_ptr<Memo>& memo = memos_[key.key];
    if (memo && !memo->done) {
      memo->waiting.emplace_back(node, &call);
      return;
    }
    if (memo) {
      call.result = memo->result;
    } else {
      memo = std::make_unique<Memo>();
      call.result.status = Status::not_needed;  // not known yet
    }
  }
  if (call.result.status != Status::not_needed) return finished_(node, call);
  if (makes_functions(node)) {
    defer(node, call, key);
  } else if (!read_back(node, call, key)) {
    int said = 0;
    const auto on_wait = [&](bool waits) {
      const bool is_long = waits ? said++ > 0 : said > 1;
      const std::string text =
          waits ? "waits for another run that is making the same result" : "goes on after waiting for another run";
      report(waits ? RunEvent::Kind::waiting : RunEvent::Kind::waited, node, call.item, is_long ? text : "");
    };
    const Store::Claim claim =
        settings_.store ? settings_.store->claim(key.key, settings_.cancelled, on_wait) : Store::Claim();
    // Another process may have made it in the meantime.
    if (!read_back(node, call, key)) call.result = perform(node, call.inputs, call.item, key);
  }
  share(key.key, call.result);
  finished_(node, call);
}

bool Evaluation::find(std::size_t node, Call& call) {
  const Recipe key = recipe(node, call);
  if (makes_functions(node)) {
    defer(node, call, key);
    return true;
  }
  return read_back(node, call, key);
}

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

bool Evaluation::read_back(std::size_t node, Call& call, const Recipe& recipe) {
  if (!settings_.store || settings_.made_anew.contains(pipeline_.nodes[node].id)) return false;
  std::optional<StoredResult> stored = settings_.store->find(recipe.key);
  if (!stored) return false;
  const std::vector<PortInfo>& outputs = pipeline_.nodes[node].info.outputs;
  if (!std::equal(stored->outputs.begin(), stored->outputs.end(), outputs.begin(), outputs.end(), is_of)) {
    settings_.store->drop(recipe.key);
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

void Evaluation::share(const Digest& key, const CallResult& result) {
  std::vector<std::pair<std::size_t, Call*>> waiting;
  {
    const std::scoped_lock lock(mutex_);
    Memo& memo = *memos_[key];
    memo.done = true;
    memo.result = result;
    waiting.swap(memo.waiting);
  }
  for (const auto& [node, call] : waiting) {
    call->result = result;
    finished_(node, *call);
  }
}

CallResult Evaluation::perform(std::size_t node, std::vector<Value> inputs, const std::string& item,
                               const Recipe& recipe) {
  CallResult result;
  std::vector<std::string> warnings;
  const Clock::time_point start = Clock::now();
  double seconds = 0;
  try {
    if (settings_.cancelled && settings_.cancelled->load()) throw Cancelled();
    const Digest before = states_of_files(pipeline_.nodes[node]);
    write_back_files(pipeline_.nodes[node]);
    // Isolated, so that a thread that waits inside this node does not take up another node's work and stretch its time.
    result.outputs = tbb::this_task_arena::isolate([&] { return call_node(node, inputs, item, recipe, warnings); });
    if (const std::string elsewhere = working_folder_.go_back(); !elsewhere.empty())
      throw Error("the working folder was changed to " + elsewhere + " while it ran; a plugin must leave it as it is");
    check_unchanged(node, inputs, recipe, before);
    seconds = seconds_since(start);
    for (std::size_t i = 0; i < result.outputs.size(); ++i) finish_value(result.outputs[i], recipe.key, i, inputs);
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
  } catch (const std::exception& error) {
    result.status = Status::failed;
    result.reason = error.what();
  }
  working_folder_.go_back();  // also where it failed
  if (result.status == Status::failed)
    report(RunEvent::Kind::failed, node, item, failure_text(node, item, result.reason));
  if (result.status == Status::done) save(node, inputs, recipe, result, seconds, std::move(warnings));
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

/// What was read must be what the key counts, or the store would keep it for another content for ever. A file that was
/// changed and changed back has another state than before.
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
      leaf.data = leaf.source->data(definition.info.inputs[i].type);
    });
}

std::vector<Value> Evaluation::call_node(std::size_t node, std::vector<Value>& inputs, const std::string& item,
                                         const Recipe& recipe, std::vector<std::string>& warnings) {
  const PipelineNode& called = pipeline_.nodes[node];
  const bool apart = runs_apart(called);
  if (!apart || !inputs.empty()) make_inputs(catalogue_.load(called.info.name), inputs);
  report(RunEvent::Kind::started, node, item, "");
  const Context::Hooks hooks = make_hooks(node, item, seed_of(recipe.recipe, settings_.seed), warnings);
  if (apart) return call_apart(catalogue_, called, inputs, hooks, settings_);
  const NodeDefinition& definition = catalogue_.load(called.info.name);
  const std::shared_ptr<void> options = definition.make_options();
  for (std::size_t i = 0; i < called.options.size(); ++i) definition.set_option[i](options.get(), called.options[i]);
  Context context(hooks);
  return definition.call(inputs, options.get(), context);
}

void Evaluation::save(std::size_t node, const std::vector<Value>& inputs, const Recipe& recipe,
                      const CallResult& result, double seconds, std::vector<std::string> warnings) {
  const std::vector<PortInfo>& outputs = pipeline_.nodes[node].info.outputs;
  if (!settings_.store ||
      std::any_of(outputs.begin(), outputs.end(), [](const PortInfo& output) { return output.type.is_function; }))
    return;
  Provenance made_from = provenance(node, inputs);
  made_from.seconds = seconds;
  made_from.warnings = std::move(warnings);
  const std::string fault = settings_.store->save(recipe.key, result.outputs, made_from);
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
  hooks.log = [this, node, item, &warnings](std::string_view text, bool is_warning) {
    if (is_warning) {
      const std::scoped_lock lock(warnings_mutex_);
      warnings.emplace_back(text);
    }
    report(is_warning ? RunEvent::Kind::warning : RunEvent::Kind::message, node, item, std::string(text));
  };
  return hooks;
}

std::string Evaluation::failure_text(std::size_t index, const std::string& item, const std::string& reason) const {
  const PipelineNode& node = pipeline_.nodes[index];
  std::string text = "node '" + node.id + "' (" + node.info.name + ")";
  if (!item.empty()) text += " for " + item;
  text += " failed: " + reason;
  std::string inputs;
  for (const Wire& wire : node.wires) {
    inputs += (inputs.empty() ? "" : ", ") + node.info.inputs[std::size_t(wire.port)].name + " = ";
    for (std::size_t i = 0; i < wire.sources.size(); ++i) inputs += (i ? " + " : "") + wire.sources[i].text;
  }
  return inputs.empty() ? text : text + " (its inputs: " + inputs + ")";
}

Provenance Evaluation::provenance(std::size_t index, const std::vector<Value>& inputs) const {
  const PipelineNode& node = pipeline_.nodes[index];
  Provenance result;
  result.node = node.info.name;
  result.build_id = catalogue_.library_of(node.info.name)->build_id;
  const Contents read = files_read_.of(node);
  for (std::size_t i = 0; i < node.options.size(); ++i)
    result.options[node.info.options[i].name] = text_of(node.options[i], node.info.options[i].type, read);
  for (std::size_t i = 0; i < inputs.size(); ++i) result.inputs[node.info.inputs[i].name] = key_of(inputs[i]);
  result.random = node.info.random;
  result.seed = settings_.seed;
  return result;
}

std::string Evaluation::place(std::size_t node, const std::string& item) const {
  return std::filesystem::absolute(pipeline_.file).lexically_normal().string() + "\n" + pipeline_.nodes[node].id +
         "\n" + item;
}

void Evaluation::remember(std::size_t node, const Call& call, const Recipe& recipe) {
  if (settings_.store && settings_.remember)
    settings_.store->remember(place(node, call.item), {recipe.key, provenance(node, call.inputs)});
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

double Evaluation::seconds_last_time(std::size_t node, const Call& call) const {
  const auto last = settings_.store ? settings_.store->last(place(node, call.item)) : std::nullopt;
  const auto stored = last ? settings_.store->find(last->key) : std::nullopt;
  return stored ? stored->provenance.seconds : 0;
}

std::string Evaluation::change_since_last(std::size_t node, const Call& call) const {
  const auto last = settings_.store ? settings_.store->last(place(node, call.item)) : std::nullopt;
  if (!last) return "it has not run before";
  const std::string changes = difference(last->provenance, provenance(node, call.inputs));
  return changes.empty()
             ? "the store has no result of it: it failed, was stopped or removed, or the processor is another"
             : changes;
}

}  // namespace marrow
