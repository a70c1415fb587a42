// SPDX-License-Identifier: Apache-2.0
#include "marrow/runtime/pipeline/pipeline_resolved.hpp"

#include <algorithm>

#include "marrow/base/printable.hpp"
#include "marrow/runtime/pipeline/may_fail.hpp"
#include "marrow/runtime/pipeline/pipeline_names.hpp"

namespace marrow {
namespace {

/// The indices of the nodes, sources before users. It is the order of somebody who goes through the file in rounds, and
/// in each round takes every node whose sources are all taken. So the round of a node is that of its latest source, or
/// the next one if that source is below it in the file.
std::vector<std::size_t> order_of(const std::vector<PipelineNode>& nodes) {
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

void sort_nodes(Pipeline& pipeline) {
  std::vector<PipelineNode>& nodes = pipeline.nodes;
  std::vector<int> place_of(nodes.size());
  std::vector<PipelineNode> sorted;
  for (const std::size_t i : order_of(nodes)) {
    place_of[i] = int(sorted.size());
    sorted.push_back(std::move(nodes[i]));
  }
  for (PipelineNode& node : sorted)
    for (Wire& wire : node.wires)
      for (Reference& source : wire.sources) source.node = place_of[std::size_t(source.node)];
  for (PipelineOutput& output : pipeline.outputs) output.source.node = place_of[std::size_t(output.source.node)];
  nodes = std::move(sorted);
}

void check_picks(const Pipeline& pipeline, const Reference& source, Diagnostics& diagnostics) {
  Reference whole = source;
  whole.items.clear();
  const std::size_t axes = pipeline.axes_of(whole).size();
  if (source.items.size() > axes)
    diagnostics.add(source.place, in_quotes(source.text) + " picks " + in_quotes(source.items[axes]) + ", but " +
                                      (axes ? "an item of each of its axes is picked already" : "it is not a list"));
}

void find_axes(Pipeline& pipeline, std::size_t index, Diagnostics& diagnostics) {
  PipelineNode& node = pipeline.nodes[index];
  for (const Wire& wire : node.wires) {
    const std::string& consumed = node.input_of(wire).axis;
    for (const Reference& source : wire.sources) {
      check_picks(pipeline, source, diagnostics);
      if (!diagnostics.empty()) return;
      if (node.repetition) continue;
      for (const std::string& axis : pipeline.axes_of(source)) {
        if (axis == consumed && wire.is_list_literal)
          diagnostics.add(source.place, in_quotes(source.text) + " is already a list over " + in_quotes(axis),
                          "pick one item of it");
        else if (axis != consumed && !contains(node.mapped_axes, axis))
          node.mapped_axes.push_back(axis);
      }
    }
  }
  if (node.repetition) check_axes_of_repetition(pipeline, node, diagnostics);
  for (const PortInfo& output : node.info.outputs)
    if (!output.axis.empty() && contains(node.mapped_axes, output.axis))
      diagnostics.add(node.place,
                      "node " + in_quotes(node.id) + " is called for each item along " + in_quotes(output.axis) +
                          ", but its output '" + output.name + "' is itself a list over it",
                      "pick one item of its input");
}

}  // namespace

void order_and_find_axes(Pipeline& pipeline, Diagnostics& diagnostics) {
  sort_nodes(pipeline);
  for (std::size_t i = 0; i < pipeline.nodes.size() && diagnostics.empty(); ++i) find_axes(pipeline, i, diagnostics);
  if (!diagnostics.empty()) return;
  for (const PipelineOutput& output : pipeline.outputs) check_picks(pipeline, output.source, diagnostics);
  check_may_fail(pipeline, diagnostics);
}

}  // namespace marrow
