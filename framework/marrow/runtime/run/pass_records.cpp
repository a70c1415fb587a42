// SPDX-License-Identifier: Apache-2.0
// Sums up what the passes of a body did, for the record of the run.
#include "marrow/runtime/run/pass_records.hpp"

#include <algorithm>

#include "marrow/runtime/pipeline/pipeline_names.hpp"

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

}  // namespace marrow
