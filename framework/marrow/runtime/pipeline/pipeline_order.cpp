// SPDX-License-Identifier: Apache-2.0
#include "marrow/runtime/pipeline/pipeline_order.hpp"

#include <algorithm>

namespace marrow {

std::vector<std::size_t> pipeline_order(const std::vector<PipelineNode>& nodes) {
  // The order is as if one went through the file in rounds, and in each round took the nodes that have all their
  // sources. So a node is taken in the round of its latest source, or in the next round if that source stands below it.
  std::vector<std::vector<std::size_t>> users(nodes.size());
  std::vector<std::size_t> waiting_for(nodes.size()), round(nodes.size()), order;
  for (std::size_t i = 0; i < nodes.size(); ++i)
    for (const Wire& wire : nodes[i].wires)
      for (const Reference& source : wire.sources) {
        users[std::size_t(source.node)].push_back(i);
        ++waiting_for[i];
      }
  for (std::size_t i = 0; i < nodes.size(); ++i)
    if (waiting_for[i] == 0) order.push_back(i);
  for (std::size_t k = 0; k < order.size(); ++k)
    for (const std::size_t user : users[order[k]]) {
      round[user] = std::max(round[user], round[order[k]] + (order[k] > user));
      if (--waiting_for[user] == 0) order.push_back(user);
    }
  std::sort(order.begin(), order.end(),
            [&](std::size_t a, std::size_t b) { return std::pair(round[a], a) < std::pair(round[b], b); });
  return order;
}

}  // namespace marrow
