// SPDX-License-Identifier: Apache-2.0
// Queries about the result of a run.
#include <algorithm>

#include "marrow/base/number_text.hpp"
#include "marrow/runtime/node/mapping.hpp"
#include "marrow/runtime/run/executor.hpp"

namespace marrow {

using Status = NodeRecord::Status;

const char* status_name(Status status) {
  static constexpr const char* kNames[] = {"not needed", "done",      "skipped",     "failed",
                                           "not run",    "cancelled", "failed alone"};
  return kNames[int(status)];
}

bool NodeRecord::was_stopped() const { return status == Status::not_run && calls + cached == 0; }

std::string not_run_text(int nodes) {
  return formatted("{} not run because of it", counted(nodes, "node was", "nodes were"));
}

bool RunResult::failed() const {
  return std::any_of(nodes.begin(), nodes.end(), [](const NodeRecord& node) { return node.status == Status::failed; });
}

bool RunResult::cancelled() const {
  return std::any_of(nodes.begin(), nodes.end(),
                     [](const NodeRecord& node) { return node.status == Status::cancelled; });
}

Value value_of(const RunResult& result, const Reference& source) {
  const NodeRecord& node = result.nodes[std::size_t(source.node)];
  if (node.outputs.empty()) return {};
  Value value = node.outputs[std::size_t(source.output)];
  for (const std::string& item : source.items) value = picked(value, item, source.text);
  return value;
}

}  // namespace marrow
