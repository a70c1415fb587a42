// SPDX-License-Identifier: Apache-2.0
#include "marrow/runtime/run/stopped_nodes.hpp"

#include "marrow/base/number_text.hpp"

namespace marrow {

using Status = NodeRecord::Status;

bool NodeRecord::was_stopped() const { return status == Status::not_run && calls + cached == 0; }

std::string not_run_text(int nodes) {
  return formatted("{} not run because of it", counted(nodes, "node was", "nodes were"));
}

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

}  // namespace marrow
