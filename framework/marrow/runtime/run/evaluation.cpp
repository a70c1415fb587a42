// SPDX-License-Identifier: Apache-2.0
// Finds the result of each call, once for each recipe within a run. Reads it from the store if it is there.
#include "marrow/runtime/run/evaluation.hpp"

#include "marrow/base/printable.hpp"
#include "marrow/runtime/run/node_calls.hpp"
#include "marrow/runtime/run/replay.hpp"
#include "marrow/runtime/store/digest_memory.hpp"
#include "marrow/runtime/store/shared_folder.hpp"
#include "marrow/runtime/store/shared_store.hpp"

namespace marrow {

using Status = NodeRecord::Status;

namespace {

/// Whether the kept result has another input where `now` has the same as the last time.
bool has_other_inputs(const Provenance& kept, const Provenance& last, const Provenance& now) {
  const auto key_in = [](const Provenance& from, const std::string& port) {
    const auto found = from.inputs.find(port);
    return found == from.inputs.end() ? Digest{} : found->second;
  };
  return std::any_of(now.inputs.begin(), now.inputs.end(), [&](const auto& input) {
    return key_in(last, input.first) == input.second && key_in(kept, input.first) != input.second;
  });
}

}  // namespace

/// The result of a recipe. It is being made until `done` is set. Then all calls with the same key share it.
struct Evaluation::Memo {
  bool done = false;
  CallResult result;
  std::vector<std::pair<std::size_t, Call*>> waiting;
};

Evaluation::Evaluation(const Pipeline& pipeline, const Catalogue& catalogue, const RunSettings& settings,
                       std::vector<NodeRecord>& records, std::mutex& mutex,
                       std::function<void(std::size_t, Call&)> finished)
    : pipeline_(pipeline),
      catalogue_(catalogue),
      settings_(settings),
      records_(records),
      mutex_(mutex),
      finished_(std::move(finished)) {
  if (settings_.store) keep_digests_in(settings_.store->folder());
}
Evaluation::~Evaluation() {
  try {
    if (!remembered_.empty()) settings_.store->remember(place(), remembered_);
  } catch (const std::exception&) {  // the next plan does not know what changed
  }
}

void Evaluation::report(RunEvent::Kind kind, std::size_t node, const std::string& item, std::string text,
                        double fraction, double seconds, LogLevel level) const {
  if (!settings_.observer) return;
  if (kind == RunEvent::Kind::warning) level = LogLevel::warning;
  const std::scoped_lock lock(observer_mutex_);
  settings_.observer({kind, pipeline_.nodes[node].id, item, std::move(text), fraction, seconds, level});
}

void Evaluation::forward(const RunEvent& event) const {
  const std::scoped_lock lock(observer_mutex_);
  settings_.observer(event);
}

Evaluation::Recipe Evaluation::recipe(std::size_t node, const Call& call, Contents* contents) const {
  const NodeInfo& info = pipeline_.nodes[node].info;
  const Digest recipe = recipe_of(pipeline_.nodes[node], call.inputs, contents);
  return {recipe, result_key(recipe, catalogue_.library_of(info.name)->build_id, info.random, settings_.seed)};
}

/// Notes what the node's files hold. The run's record then tells what they held when they were read, whatever happens
/// to them later.
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
  if (settings_.call_keys && !makes_functions(node))
    settings_.call_keys->note(settings_.within, pipeline_.nodes[node].id, call.item, key.key);
  return key;
}

/// A replay reads back what its run kept, even if the plugin that made it has been rebuilt since. The call that is made
/// again then has the same inputs.
void Evaluation::take_kept_key(std::size_t node, const Call& call, Recipe& recipe) const {
  if (!settings_.replay || !settings_.store || makes_functions(node)) return;
  const auto kept = settings_.replay->kept_key(settings_.within, pipeline_.nodes[node].id, call.item);
  if (!kept || *kept == recipe.key || !settings_.store->find(*kept)) return;
  recipe.key = *kept;
  recipe.is_kept = true;
}

bool Evaluation::is_replayed(std::size_t node, const std::string& item) const {
  const Replay* replay = settings_.replay;
  return replay && replay->within == settings_.within && replay->node == pipeline_.nodes[node].id &&
         replay->item == item;
}

void Evaluation::end_replay(std::size_t node, const CallResult& result, double seconds) const {
  if (settings_.replay->on_end)
    settings_.replay->on_end(pipeline_.nodes[node], {result.status, result.reason, result.outputs, seconds});
}

bool Evaluation::makes_functions(std::size_t node) const {
  const std::vector<PortInfo>& outputs = pipeline_.nodes[node].info.outputs;
  return std::all_of(outputs.begin(), outputs.end(),
                     [](const PortInfo& output) { return output.type.is_function && output.axis.empty(); });
}

/// A function is made when a node that runs needs it. But if the node may fail, those that use the function must know
/// it before they run.
bool Evaluation::is_deferred(std::size_t node) const {
  return makes_functions(node) && !pipeline_.nodes[node].may_fail;
}

void Evaluation::evaluate(std::size_t node, Call& call) {
  Recipe key;
  try {
    key = noted_recipe(node, call);
    remember(node, call, key);
  } catch (const std::exception& error) {  // a file that its options name cannot be read
    note_failure(node, call.item, error.what(), 0, call.inputs);
    call.result = failure(node, call.item, error.what());
    return finished_(node, call);
  }
  if (is_replayed(node, call.item)) {
    call.result = perform(node, call.inputs, call.item, key);
    return finished_(node, call);
  }
  take_kept_key(node, call, key);
  std::optional<CallResult> known;
  {
    const std::scoped_lock lock(mutex_);
    std::unique_ptr<Memo>& memo = memos_[key.key];
    if (memo && !memo->done) {
      memo->waiting.emplace_back(node, &call);
      return;
    }
    if (memo)
      known = memo->result;
    else
      memo = std::make_unique<Memo>();
  }
  if (known) return take(node, call, *known);
  if (is_deferred(node))
    defer(node, call, key);
  else if (makes_functions(node))
    call.result = perform(node, call.inputs, call.item, key);
  else
    read_or_make(node, call, key);
  share(key.key, call.result);
  finished_(node, call);
}

SharedStore* Evaluation::shared_for(std::size_t node) const {
  SharedStore* shared = settings_.store ? settings_.store->shared() : nullptr;
  const auto& wanted = settings_.wanted_by_others;
  const bool is_of_use = settings_.within.empty() && (!wanted || wanted->contains(pipeline_.nodes[node].id));
  return shared && is_of_use ? shared : nullptr;
}

void Evaluation::complain_of(SharedStore& shared, std::size_t node) {
  if (const std::string text = shared.complaint(); !text.empty()) report(RunEvent::Kind::warning, node, "", text);
}

void Evaluation::read_or_make(std::size_t node, Call& call, const Recipe& recipe) {
  SharedStore* shared = shared_for(node);
  const bool is_found = read_back(node, call, recipe, shared ? Where::anywhere : Where::here);
  if (shared) complain_of(*shared, node);
  if (is_found) return;
  int said = 0;
  const auto on_wait = [&](bool waits) {
    const bool is_long = waits ? said++ > 0 : said > 1;
    const std::string text =
        waits ? "waits for another run that is making the same result" : "goes on after waiting for another run";
    report(waits ? RunEvent::Kind::waiting : RunEvent::Kind::waited, node, call.item, is_long ? text : "");
  };
  const Store::Claim claim =
      settings_.store ? settings_.store->claim(recipe.key, settings_.cancelled, on_wait) : Store::Claim();
  // Another process may have made the result in the meantime.
  if (read_back(node, call, recipe, Where::here)) return;
  if (!shared || settings_.made_anew.contains(pipeline_.nodes[node].id) || !shared->accepts()) {
    call.result = perform(node, call.inputs, call.item, recipe);
    return;
  }
  said = 0;
  const SharedClaim among_hosts = shared->claim(recipe.key, settings_.cancelled, on_wait);
  if (!read_back(node, call, recipe, Where::anew)) call.result = perform(node, call.inputs, call.item, recipe);
  complain_of(*shared, node);
}

/// Ends a call with the result of another call of the same recipe. That call may belong to a node that may fail, which
/// this one may not.
void Evaluation::take(std::size_t node, Call& call, const CallResult& result) {
  const bool is_worse = result.status == Status::failed_alone && !pipeline_.nodes[node].may_fail;
  call.result = is_worse ? failure(node, call.item, result.reason) : result;
  finished_(node, call);
}

bool Evaluation::find(std::size_t node, Call& call) {
  const Recipe key = recipe(node, call);
  if (is_deferred(node)) {
    defer(node, call, key);
    return true;
  }
  return read_back(node, call, key, shared_for(node) ? Where::anywhere : Where::here);
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
  for (const auto& [node, call] : waiting) take(node, *call, result);
}

CallResult Evaluation::failure(std::size_t node, const std::string& item, const std::string& reason,
                               bool is_own) const {
  const bool alone = is_own && pipeline_.nodes[node].may_fail;
  report(RunEvent::Kind::failed, node, item,
         failure_text(node, item, reason) + (alone ? "; the run goes on without it" : ""), 0, 0,
         alone ? LogLevel::warning : LogLevel::error);
  return {alone ? Status::failed_alone : Status::failed, reason, {}};
}

void Evaluation::note_failure(std::size_t node, const std::string& item, const std::string& reason, std::uint64_t seed,
                              const std::vector<Value>& inputs) const {
  const PipelineNode& failed = pipeline_.nodes[node];
  if (settings_.on_failed_call)
    settings_.on_failed_call({failed, settings_.within, item, failed.id, item, reason, seed, inputs});
  if (is_replayed(node, item)) end_replay(node, {Status::failed, reason, {}}, 0);
}

std::string Evaluation::failure_text(std::size_t index, const std::string& item, const std::string& reason) const {
  const PipelineNode& node = pipeline_.nodes[index];
  std::string text = "node '" + node.id + "' (" + node.info.name + ")";
  if (!item.empty()) text += " for " + item;
  if (!settings_.within.empty()) text += " in " + settings_.within;
  text += " failed: " + reason;
  std::string inputs;
  for (const Wire& wire : node.wires) {
    inputs += (inputs.empty() ? "" : ", ") + node.input_of(wire).name + " = ";
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
  if (const std::string version = version_of_program(node); !version.empty())
    result.options["version_command"] += " (prints " + in_quotes(version) + ")";
  for (std::size_t i = 0; i < inputs.size(); ++i) result.inputs[node.info.inputs[i].name] = key_of(inputs[i]);
  result.random = node.info.random;
  result.seed = settings_.seed;
  return result;
}

std::string Evaluation::place() const {
  const std::string file = std::filesystem::absolute(pipeline_.file).lexically_normal().string();
  return settings_.within.empty() ? file : file + "\n" + settings_.within;
}

std::string Evaluation::name_of(std::size_t node, const Call& call) const {
  return pipeline_.nodes[node].id + "\n" + call.item;
}

/// Functions are not kept, so nobody asks what they were made from.
void Evaluation::remember(std::size_t node, const Call& call, const Recipe& recipe) {
  if (!settings_.store || !settings_.remember || makes_functions(node)) return;
  Store::Last last{recipe.key, provenance(node, call.inputs)};
  const std::scoped_lock lock(mutex_);
  remembered_.insert_or_assign(name_of(node, call), std::move(last));
}

std::optional<Store::Last> Evaluation::last(std::size_t node, const Call& call) const {
  if (!last_results_) last_results_ = settings_.store ? settings_.store->last(place()) : Store::LastResults();
  const auto found = last_results_->find(name_of(node, call));
  return found == last_results_->end() ? std::nullopt : std::optional(found->second);
}

double Evaluation::seconds_last_time(std::size_t node, const Call& call) const {
  const auto last = this->last(node, call);
  const auto stored = last ? settings_.store->find(last->key) : std::nullopt;
  return stored ? stored->provenance.seconds : 0;
}

/// The least recently used first.
const std::vector<Store::Last>& Evaluation::kept_results() const {
  if (kept_results_) return *kept_results_;
  std::set<std::string> names;
  for (const PipelineNode& node : pipeline_.nodes) names.insert(node.info.name);
  kept_results_.emplace();
  try {
    for (Store::Entry& entry : settings_.store->entries())
      if (names.contains(entry.provenance.node)) kept_results_->push_back({entry.key, std::move(entry.provenance)});
  } catch (const Error&) {  // a folder of the store cannot be read: then the last run is what is compared with
  }
  return *kept_results_;
}

std::string Evaluation::reason_to_run(std::size_t node, const Call& call) const {
  if (makes_functions(node)) return "it may fail, and a function is not kept";
  const auto last = this->last(node, call);
  if (!last) return "it has not run before";
  const Provenance now = provenance(node, call.inputs);
  std::string changes = difference(last->provenance, now);
  const Provenance* nearest = changes.empty() ? nullptr : nearest_result(kept_results(), *last, now);
  if (nearest) changes = difference(*nearest, now);
  return changes.empty()
             ? "the store has no result of it: it failed, was stopped or removed, or the processor is another"
             : changes;
}

const Provenance* nearest_result(const std::vector<Store::Last>& kept, const Store::Last& last, const Provenance& now) {
  const Provenance* nearest = nullptr;
  std::tuple<bool, std::size_t, bool> least;
  for (const Store::Last& one : kept) {
    if (one.provenance.node != now.node) continue;
    const std::tuple rank(has_other_inputs(one.provenance, last.provenance, now),
                          differences(one.provenance, now).size(), one.key != last.key);
    if (nearest && rank > least) continue;
    nearest = &one.provenance;
    least = rank;
  }
  return nearest;
}

}  // namespace marrow
