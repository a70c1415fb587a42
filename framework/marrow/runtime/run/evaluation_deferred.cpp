// SPDX-License-Identifier: Apache-2.0
// Results that exist before their data. A call is made, or an entry of the store is read, when something needs the
// data.
#include <algorithm>
#include <optional>

#include "marrow/runtime/run/evaluation.hpp"
#include "marrow/runtime/run/keys.hpp"

namespace marrow {
namespace {

using Status = NodeRecord::Status;

/// Whether a stored value has the type and the axis of the output. The entry may come from another build or be damaged.
bool is_of(const Value& value, const PortInfo& output) {
  if (value.type != output.type || (value.is_list() && value.axis != output.axis)) return false;
  if (!output.axis.empty() && !value.is_list()) return value.is_absent();
  return std::all_of(value.items.begin(), value.items.end(),
                     [&](const Value& item) { return item.type == output.type && !item.is_list(); });
}

}  // namespace

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
