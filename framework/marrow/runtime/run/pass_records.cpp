// SPDX-License-Identifier: Apache-2.0
// Sums up what the passes of a body did, for the record of the run; and what they must make.
#include "marrow/runtime/run/passes.hpp"

#include <algorithm>

#include "marrow/runtime/pipeline/pipeline_names.hpp"
#include "marrow/runtime/run/replay.hpp"

namespace marrow {
namespace {

using Status = NodeRecord::Status;

/// The keys of a value, without its data.
Value without_data(Value value) {
  value.data = nullptr;
  value.source = nullptr;
  for (Value& item : value.items) item = without_data(std::move(item));
  return value;
}

int rank_of(Status status) {
  static constexpr Status kOrder[] = {Status::failed,       Status::cancelled, Status::not_run,
                                      Status::failed_alone, Status::skipped,   Status::done};
  return int(std::find(std::begin(kOrder), std::end(kOrder), status) - std::begin(kOrder));
}

void append(const Value& value, const std::string& pass, const std::string& axis, Value& list) {
  list.type = value.type;
  list.axis = axis;
  list.names.push_back(pass);
  list.items.push_back(without_data(value));
}

/// Adds what a node did in one pass. `pass` is empty for what was done once.
void add_node(const NodeRecord& from, const std::string& pass, const std::string& axis, NodeRecord& to) {
  if (from.status == Status::not_needed && from.outputs.empty()) return;
  if (to.status == Status::not_needed || rank_of(from.status) < rank_of(to.status)) {
    to.status = from.status;
    to.reason = from.reason.empty() || pass.empty() ? from.reason : pass + ": " + from.reason;
  }
  to.seconds += from.seconds;
  to.calls += from.calls;
  to.cached += from.cached;
  to.cached_seconds += from.cached_seconds;
  to.peak_memory_mb = std::max(to.peak_memory_mb, from.peak_memory_mb);
  for (const auto& [option, digest] : from.files) to.files[option] = digest;
  to.outputs.resize(std::max(to.outputs.size(), from.outputs.size()));
  for (std::size_t k = 0; k < from.outputs.size(); ++k)
    if (pass.empty())
      to.outputs[k] = without_data(from.outputs[k]);
    else
      append(from.outputs[k], pass, axis, to.outputs[k]);
}

/// Adds the passes of a body within the body.
void add_inner_passes(const NodeRecord& from, const std::string& pass, const std::string& axis, NodeRecord& to) {
  if (!from.passes) return;
  if (!to.passes) to.passes = std::make_shared<PassesRecord>();
  PassesRecord& sum = *to.passes;
  for (PassesRecord::Pass inner : from.passes->passes) {
    inner.name = pass.empty() ? inner.name : pass + "/" + inner.name;
    sum.passes.push_back(std::move(inner));
  }
  sum.end = from.passes->end;
  sum.given.resize(from.passes->given.size());
  for (std::size_t i = 0; i < sum.given.size(); ++i) append(from.passes->given[i], pass, axis, sum.given[i]);
  sum.nodes.resize(from.passes->nodes.size());
  for (std::size_t i = 0; i < sum.nodes.size(); ++i) {
    add_node(from.passes->nodes[i], pass, axis, sum.nodes[i]);
    add_inner_passes(from.passes->nodes[i], pass, axis, sum.nodes[i]);
  }
}

void add_nodes(const Repetition& repetition, const Pipeline& run, const std::vector<NodeRecord>& done,
               const std::vector<std::string>& left_out, const std::string& pass, PassesRecord& record) {
  const std::size_t count = repetition.alone.nodes.size(), offset = run.nodes.size() - count;
  record.nodes.resize(count);
  for (std::size_t i = 0; i < count; ++i) {
    if (contains(left_out, run.nodes[offset + i].id)) continue;
    add_node(done[offset + i], pass, repetition.axis, record.nodes[i]);
    add_inner_passes(done[offset + i], pass, repetition.axis, record.nodes[i]);
  }
}

}  // namespace

void add_pass(const Repetition& repetition, const Pipeline& run, const std::vector<NodeRecord>& done,
              const std::vector<std::string>& constants, const std::string& pass, PassesRecord& record) {
  add_nodes(repetition, run, done, constants, pass, record);
  record.given.resize(repetition.given.size());
  for (std::size_t i = 0; i < repetition.given.size(); ++i)
    for (std::size_t n = 0; n + repetition.alone.nodes.size() < run.nodes.size(); ++n)
      if (run.nodes[n].id == repetition.given[i].node && !done[n].outputs.empty())
        append(done[n].outputs[0], pass, repetition.axis, record.given[i]);
}

void add_constants(const Repetition& repetition, const Pipeline& run, const std::vector<NodeRecord>& done,
                   PassesRecord& record) {
  add_nodes(repetition, run, done, {}, "", record);
}

/// As RunSettings::within, of what runs once.
std::string Passes::within() const {
  const std::string& outer = outer_.settings_.within;
  return (outer.empty() ? "" : outer + "/") + node_.id;
}

/// Whether a replay is about a call in a pass of this body, or in what runs once before them.
bool Passes::is_replayed_inside() const {
  return outer_.settings_.replay && outer_.settings_.replay->leads_into(within());
}

/// Whether that call is in what runs once. A body within this one may run once, too, so that passes of its own are next
/// in the place of the call.
bool Passes::only_replays() const {
  if (!is_replayed_inside()) return false;
  const std::string& place = outer_.settings_.replay->within;
  if (place.size() == within().size()) return true;
  const std::string rest = place.substr(within().size() + 1);
  const auto is_in = [&](const std::string& pass) { return rest == pass || rest.starts_with(pass + "/"); };
  if (repetition_.is_loop) return rest.find_first_not_of("0123456789") < rest.find('/');
  return std::none_of(names_.begin(), names_.end(), is_in);
}

void Passes::find_needed_outputs() {
  std::vector<bool> needed(repetition_.alone.outputs.size());
  if (repetition_.until >= 0) needed[std::size_t(repetition_.until)] = true;
  for (const Repetition::Given& given : repetition_.given)
    if (given.carried >= 0) needed[std::size_t(given.carried)] = true;
  const auto add_needed = [&](const Reference& source) {
    if (source.node == int(index_)) needed[std::size_t(source.output / 2)] = true;
  };
  const bool is_replayed = is_replayed_inside();  // then nobody uses what the body makes
  for (const PipelineNode& user : outer_.pipeline_.nodes)
    if (!is_replayed && outer_.needed_[std::size_t(&user - outer_.pipeline_.nodes.data())])
      for (const Wire& wire : user.wires)
        for (const Reference& source : wire.sources) add_needed(source);
  for (const PipelineOutput& output : outer_.pipeline_.outputs)
    if (!is_replayed) add_needed(output.source);
  for (std::size_t i = 0; i < needed.size(); ++i)
    if (needed[i]) needed_outputs_.push_back(int(i));
}

}  // namespace marrow
