// SPDX-License-Identifier: Apache-2.0
// Runs the body of a node again and again. Nodes of the body that depend on nothing that changes are run once, before
// the first pass.
#include "marrow/runtime/run/passes.hpp"

#include "marrow/base/number_text.hpp"
#include "marrow/runtime/node/types.hpp"
#include "marrow/runtime/pipeline/pipeline_names.hpp"
#include "marrow/runtime/run/replay.hpp"

namespace marrow {
namespace {

using Status = NodeRecord::Status;

/// The first reason why something of the value was not made.
std::string why_missing(const Value& value) {
  if (value.is_absent()) return value.missing;
  for (const Value& item : value.items)
    if (std::string reason = why_missing(item); !reason.empty()) return reason;
  return "";
}

/// A value that does not exist, so that what needs it is skipped.
Value left_out(const TypeInfo& type) {
  Value value;
  value.type = type;
  return value;
}

/// The body, with those values of its constant nodes as outputs that the body uses. A node that is called makes all its
/// values at once. A node with a body makes only those that something asks for.
Pipeline with_constants(Pipeline body, const std::vector<std::string>& constant_nodes) {
  std::vector<Reference> used;
  for (const PipelineOutput& output : body.outputs) used.push_back(output.source);
  for (const PipelineNode& node : body.nodes)
    for (const Wire& wire : node.wires) used.insert(used.end(), wire.sources.begin(), wire.sources.end());
  body.outputs.clear();
  for (const Reference& source : used) {
    if (source.node < 0 || !contains(constant_nodes, body.node_of(source).id)) continue;
    body.outputs.push_back({formatted("{}", body.outputs.size()), source});
  }
  return body;
}

}  // namespace

/// One run of the body, with what it refers to.
struct Passes::Run {
  Pipeline pipeline;
  RunSettings settings;
  std::unique_ptr<GraphRun> graph;
};

Passes::Passes(GraphRun& outer, std::size_t node, Call& call)
    : outer_(outer),
      index_(node),
      call_(call),
      node_(outer.pipeline_.nodes[node]),
      repetition_(*node_.repetition),
      carried_(repetition_.given.size()),
      has_carried_(repetition_.given.size()) {}
Passes::~Passes() = default;

void Passes::prepare() {
  find_needed_outputs();
  const std::size_t outputs = repetition_.alone.outputs.size();
  lists_.resize(outputs);
  last_.resize(outputs);
  for (std::size_t i = 0; i < outputs; ++i) {
    lists_[i].type = last_[i].type = node_.info.outputs[2 * i].type;
    lists_[i].axis = repetition_.axis;
  }
  is_sliced_.resize(repetition_.given.size());
  for (std::size_t i = 0; i < call_.inputs.size() && !repetition_.is_loop; ++i) {
    const std::vector<std::string> names = names_along(call_.inputs[i], repetition_.axis);
    is_sliced_[i] = !names.empty();
    if (!names.empty() && !names_.empty() && names != names_)
      throw Error(
          formatted("its inputs do not go in step along '{}': there are lists of {} and {} items, or of other names",
                    repetition_.axis, names_.size(), names.size()));
    if (!names.empty()) names_ = names;
  }
  find_constant_nodes();
}

/// The outputs of the body that somebody needs.
static Pipeline with_outputs(const Pipeline& body, const std::vector<int>& needed) {
  Pipeline result = body;
  result.outputs.clear();
  for (const int i : needed) result.outputs.push_back(body.outputs[std::size_t(i)]);
  return result;
}

void Passes::find_constant_nodes() {
  const Pipeline body = with_outputs(repetition_.body, needed_outputs_);
  std::map<std::string, bool> changes_by_name;
  for (std::size_t i = 0; i < repetition_.given.size(); ++i)
    changes_by_name[repetition_.given[i].node] = is_sliced_[i] || repetition_.given[i].carried >= 0;
  const auto is_given = [&](const std::string& id) { return changes_by_name.contains(id); };
  const std::vector<bool> needed = body.needed(is_given);
  std::vector<bool> changes(body.nodes.size()), is_used(body.nodes.size());
  for (std::size_t i = 0; i < body.nodes.size(); ++i) {
    const auto known = changes_by_name.find(body.nodes[i].id);
    if (known != changes_by_name.end()) {
      changes[i] = known->second;
      continue;
    }
    for (const Wire& wire : body.nodes[i].wires)
      for (const Reference& source : wire.sources) changes[i] = changes[i] || changes[std::size_t(source.node)];
  }
  for (std::size_t i = 0; i < body.nodes.size(); ++i) {
    if (!needed[i] || !changes[i]) continue;
    for (const Wire& wire : body.nodes[i].wires)
      for (const Reference& source : wire.sources) is_used[std::size_t(source.node)] = true;
  }
  for (const PipelineOutput& output : body.outputs) is_used[std::size_t(output.source.node)] = true;
  // Some nodes run only in the first pass, to make the carried values. They use constant nodes, too.
  const Pipeline first = with_outputs(repetition_.first, needed_outputs_);
  const std::vector<bool> needed_first = first.needed(is_given);
  const std::size_t given_to_first = first.nodes.size() - repetition_.alone.nodes.size(),
                    given_to_body = body.nodes.size() - repetition_.alone.nodes.size();
  for (std::size_t i = 0; i < repetition_.alone.nodes.size(); ++i) {
    if (!needed_first[given_to_first + i] || needed[given_to_body + i]) continue;
    for (const Wire& wire : first.nodes[given_to_first + i].wires)
      for (const Reference& source : wire.sources)
        if (std::size_t(source.node) >= given_to_first)
          is_used[std::size_t(source.node) - given_to_first + given_to_body] = true;
  }
  for (std::size_t i = 0; i < body.nodes.size(); ++i)
    if (needed[i] && is_used[i] && !changes[i]) constant_nodes_.push_back(body.nodes[i].id);
}

std::unique_ptr<Passes::Run> Passes::make_run(Pipeline pipeline, const std::string& within) {
  auto run = std::make_unique<Run>();
  run->pipeline = std::move(pipeline);
  run->settings = outer_.settings_;
  run->settings.within = this->within() + (within.empty() ? "" : "/" + within);
  run->settings.given = constants_;
  run->settings.profile = outer_.settings_.profile.inside(node_.id, within);
  for (const std::string& id : outer_.settings_.made_anew)
    if (id == node_.id)
      for (const PipelineNode& node : run->pipeline.nodes) run->settings.made_anew.insert(node.id);
  if (outer_.settings_.observer)
    run->settings.observer = [this, within](const RunEvent& event) {
      RunEvent here = event;
      here.node = node_.id + "/" + event.node;
      if (!within.empty()) here.item = within + (event.item.empty() ? "" : "/" + event.item);
      if (event.kind == RunEvent::Kind::failed && repetition_.goes_on) here.level = LogLevel::warning;
      outer_.evaluation_.forward(here);
    };
  if (outer_.settings_.on_failed_call)
    run->settings.on_failed_call = [this, within](const FailedCall& call) {
      FailedCall here = call;
      here.path = node_.id + "/" + call.path;
      if (!within.empty()) here.place = within + (call.place.empty() ? "" : "/" + call.place);
      outer_.settings_.on_failed_call(here);
    };
  return run;
}

bool Passes::has_next() {
  if (!repetition_.is_loop && pass_ >= names_.size()) return false;
  if (repetition_.at_most && pass_ >= std::size_t(repetition_.at_most)) {
    record_->end = pass_ == 1 ? "there was one pass, which is the limit"
                              : formatted("there were {} passes, which is the limit", pass_);
    return false;
  }
  return true;
}

std::string Passes::name_of_pass() const { return repetition_.is_loop ? formatted("{}", pass_ + 1) : names_[pass_]; }

std::unique_ptr<Passes::Run> Passes::next_pass() {
  is_first_ = false;
  std::map<std::string, std::vector<Value>> given;
  for (std::size_t i = 0; i < repetition_.given.size(); ++i) {
    const Repetition::Given& one = repetition_.given[i];
    const bool is_wired = i < call_.inputs.size();
    if (has_carried_[i])
      given[one.node] = {carried_[i]};
    else if (is_wired)
      given[one.node] = {is_sliced_[i] ? sliced(call_.inputs[i], repetition_.axis, pass_) : call_.inputs[i]};
    else
      is_first_ = true;
  }
  auto run = make_run(with_outputs(is_first_ ? repetition_.first : repetition_.body, needed_outputs_), name_of_pass());
  run->settings.given.merge(given);
  is_last_ = is_replayed_inside() && keep_only_replayed(run->pipeline, run->settings);
  run->graph = std::make_unique<GraphRun>(run->pipeline, outer_.catalogue_, run->settings);
  return run;
}

/// Adds work to the outer run. It is done even if the outer run is ending, so that the passes end first.
void Passes::release(const std::function<void()>& work) { outer_.enqueue(work, true); }

void Passes::begin() {
  {
    const std::scoped_lock lock(outer_.mutex_);
    ++outer_.at_work_;  // until finish(): the outer run must not end while a pass runs
  }
  try {
    prepare();
  } catch (const std::exception& error) {
    outer_.evaluation_.note_failure(index_, call_.item, error.what(), 0, call_.inputs);
    return finish(Status::failed, error.what());
  }
  if (constant_nodes_.empty() && !only_replays()) return go_on();
  try {
    run_constants();
  } catch (...) {
    outer_.set_fault();
    finish(Status::failed, "its body could not be run");
  }
}

void Passes::run_constants() {
  constants_run_ = make_run(with_constants(with_outputs(repetition_.body, needed_outputs_), constant_nodes_), "");
  for (std::size_t i = 0; i < call_.inputs.size(); ++i)
    if (!is_sliced_[i]) constants_run_->settings.given[repetition_.given[i].node] = {call_.inputs[i]};
  if (only_replays()) keep_only_replayed(constants_run_->pipeline, constants_run_->settings);
  constants_run_->graph =
      std::make_unique<GraphRun>(constants_run_->pipeline, outer_.catalogue_, constants_run_->settings);
  constants_run_->graph->begin(*outer_.arena_, [this] { release([this] { after_constants(); }); });
}

void Passes::after_constants() {
  if (only_replays()) return finish(Status::done, "");
  try {
    const RunResult& result = constants_run_->graph->result();
    for (std::size_t i = 0; i < result.nodes.size(); ++i)
      if (result.nodes[i].status == Status::failed || result.nodes[i].status == Status::cancelled)
        return finish(result.nodes[i].status, "node '" + constants_run_->pipeline.nodes[i].id +
                                                  "' of the body failed: " + result.nodes[i].reason);
    for (std::size_t i = 0; i < result.nodes.size(); ++i)
      if (contains(constant_nodes_, constants_run_->pipeline.nodes[i].id))
        constants_[constants_run_->pipeline.nodes[i].id] = result.nodes[i].outputs;
  } catch (...) {
    outer_.set_fault();
    return finish(Status::failed, "its body could not be run");
  }
  go_on();
}

/// Starts the next pass, if there is one.
void Passes::go_on() {
  try {
    if (outer_.cancelled()) return finish(Status::cancelled, "stopped before it was done");
    if (!has_next()) return finish(Status::done, "");
    run_ = next_pass();
    pass_begin_ = Clock::now();
    run_->graph->begin(*outer_.arena_, [this] { release([this] { after_pass(); }); });
  } catch (...) {
    outer_.set_fault();
    finish(Status::failed, "its body could not be run");
  }
}

void Passes::after_pass() {
  PassesRecord::Pass pass;
  pass.name = name_of_pass();
  try {
    const RunResult result = run_->graph->finish();
    pass.seconds = result.seconds;
    note_in_profile(pass.name, pass_begin_);
    if (result.cancelled()) return finish(Status::cancelled, "stopped before it was done");
    if (is_last_) return finish(Status::done, "");
    take(result, pass);
  } catch (...) {
    outer_.set_fault();
    return finish(Status::failed, "its body could not be run");
  }
  const PassesRecord::Pass& done = record_->passes.back();
  const std::size_t all = repetition_.is_loop ? std::size_t(repetition_.at_most) : names_.size();
  outer_.evaluation_.report(RunEvent::Kind::progress, index_, "",
                            "pass " + done.name + (done.reason.empty() ? "" : " failed"), double(pass_) / double(all));
  if (done.status != Status::done && !repetition_.goes_on)
    return finish(Status::failed, "pass " + done.name + " failed: " + done.reason);
  if (!record_->end.empty()) return finish(Status::done, "");
  go_on();
}

/// Takes over what a pass made.
void Passes::take(const RunResult& result, const PassesRecord::Pass& pass_so_far) {
  PassesRecord::Pass pass = pass_so_far;
  add_pass(repetition_, run_->pipeline, result.nodes, constant_nodes_, pass.name, *record_);
  std::vector<Value> made(lists_.size());
  for (std::size_t k = 0; k < needed_outputs_.size(); ++k) {
    const std::size_t i = std::size_t(needed_outputs_[k]);
    made[i] = value_of(result, run_->pipeline.outputs[k].source);
    if (pass.reason.empty()) pass.reason = why_missing(made[i]);
  }
  for (const NodeRecord& node : result.nodes)
    if (node.status == Status::failed && pass.status == Status::done) {
      pass.status = Status::failed;
      pass.reason = node.reason;
    }
  if (pass.status == Status::done) pass.reason.clear();
  for (const int k : needed_outputs_) {
    const std::size_t i = std::size_t(k);
    if (pass.status != Status::done) made[i] = left_out(lists_[i].type);
    lists_[i].names.push_back(pass.name);
    lists_[i].items.push_back(made[i]);
    if (pass.status == Status::done) last_[i] = made[i];
  }
  if (pass.status == Status::done) {
    for (std::size_t i = 0; i < carried_.size(); ++i) {
      const int output = repetition_.given[i].carried;
      if (output < 0) continue;
      carried_[i] = made[std::size_t(output)];
      has_carried_[i] = true;
    }
    if (repetition_.until >= 0) {
      const Value& value = made[std::size_t(repetition_.until)];
      if (!value.is_absent() && value.as<Stop>().stops) record_->end = value.as<Stop>().reason;
      if (!value.is_absent() && value.as<Stop>().stops && record_->end.empty()) record_->end = "the stop rule holds";
    }
  }
  record_->passes.push_back(std::move(pass));
  ++pass_;
}

void Passes::collect_outputs() {
  call_.result.outputs.clear();
  for (std::size_t i = 0; i < lists_.size(); ++i) {
    if (lists_[i].items.empty()) lists_[i] = left_out(last_[i].type);  // an empty list is an absent value
    call_.result.outputs.push_back(std::move(lists_[i]));
    call_.result.outputs.push_back(std::move(last_[i]));
  }
}

/// A pass runs on no thread of its own.
void Passes::note_in_profile(const std::string& pass, Clock::time_point begin) const {
  const ProfilePlace& place = outer_.settings_.profile;
  if (!place.profile) return;
  place.profile->add_pass(place, "passes of " + place.nodes + node_.id, node_.id, pass, begin, Clock::now());
}

void Passes::finish(Status status, const std::string& reason) {
  note_in_profile("", begin_);
  if (status == Status::failed) {
    call_.result = outer_.evaluation_.failure(index_, "", reason);
  } else {
    call_.result.status = status;
    call_.result.reason = reason;
    if (status == Status::done) collect_outputs();
  }
  // Functions among the constants were made when a pass needed them.
  if (constants_run_ && !outer_.is_broken_)
    add_constants(repetition_, constants_run_->pipeline, constants_run_->graph->result().nodes, *record_);
  double seconds = 0;
  for (const PassesRecord::Pass& pass : record_->passes) seconds += pass.seconds;
  {
    const std::scoped_lock lock(outer_.mutex_);
    NodeRecord& record = outer_.result_.nodes[index_];
    record.calls = int(record_->passes.size());
    record.seconds = seconds;
    record.passes = record_;
  }
  if (status == Status::done) outer_.evaluation_.report(RunEvent::Kind::finished, index_, "", "", 1, seconds);
  if (outer_.evaluation_.is_replayed(index_, call_.item)) outer_.evaluation_.end_replay(index_, call_.result, seconds);
  run_ = nullptr;
  constants_.clear();
  outer_.finish_call(index_, call_);
  const std::scoped_lock lock(outer_.mutex_);
  --outer_.at_work_;  // this work itself still counts
}

void Passes::plan(PlannedNode& planned) {
  prepare();
  const auto add_runs = [&](const Pipeline& pipeline, const std::vector<PlannedNode>& nodes, const std::string& pass) {
    for (std::size_t i = 0; i < nodes.size(); ++i) {
      if (nodes[i].what != PlannedNode::What::runs) continue;
      ++planned.calls_to_make;
      if (planned.why.empty())
        planned.why =
            (pass.empty() ? "" : "pass " + pass + ": ") + "node '" + pipeline.nodes[i].id + "': " + nodes[i].why;
      planned.seconds += nodes[i].seconds;
    }
  };
  constant_nodes_.clear();  // a plan makes nothing, so that they are planned in the first pass
  while (has_next()) {
    run_ = next_pass();
    const std::vector<PlannedNode> nodes = run_->graph->plan(planned.why.empty());
    add_runs(run_->pipeline, nodes, name_of_pass());
    ++planned.calls;
    if (planned.calls_to_make) return;
    PassesRecord::Pass pass;
    pass.name = name_of_pass();
    take(run_->graph->result(), pass);
    if (!record_->end.empty()) break;
  }
  call_.result.status = Status::done;
  collect_outputs();
}

}  // namespace marrow
