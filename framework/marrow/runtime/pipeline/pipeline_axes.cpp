// SPDX-License-Identifier: Apache-2.0
#include "marrow/runtime/pipeline/pipeline_resolved.hpp"

#include <algorithm>
#include <map>
#include <sstream>

#include "marrow/base/printable.hpp"
#include "marrow/runtime/node/types.hpp"
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

struct WaitedFor {
  std::string port;
  std::size_t node;
};

/// Which nodes wait for which. Nodes can be taken out.
class WaitingNodes {
 public:
  explicit WaitingNodes(const WrittenPipeline& written)
      : sources_(written.nodes.size()),
        users_(sources_.size()),
        waits_for_(sources_.size()),
        is_left_(sources_.size(), true) {
    std::map<std::string, std::size_t> index;
    for (std::size_t i = 0; i < sources_.size(); ++i) index.emplace(written.nodes[i].id, i);
    for (std::size_t i = 0; i < sources_.size(); ++i)
      for (const auto& [port, value] : written.nodes[i].wires) {
        const auto add = [&, i, name = port](const YAML::Node& reference) {
          if (!reference.IsScalar()) return;
          const auto found = index.find(reference.Scalar().substr(0, reference.Scalar().find('.')));
          if (found == index.end()) return;
          sources_[i].push_back({name, found->second});
          users_[found->second].push_back(i);
          ++waits_for_[i];
        };
        if (value.value.IsSequence())
          for (const YAML::Node& item : value.value) add(item);
        else
          add(value.value);
      }
    for (std::size_t i = 0; i < sources_.size(); ++i)
      if (waits_for_[i] == 0) take_out({i});
  }

  std::size_t count() const { return sources_.size(); }
  bool is_left(std::size_t node) const { return is_left_[node]; }

  /// Takes out these nodes and all nodes that wait for nothing else.
  void take_out(std::vector<std::size_t> nodes) {
    while (!nodes.empty()) {
      const std::size_t node = nodes.back();
      nodes.pop_back();
      if (!is_left_[node]) continue;
      is_left_[node] = false;
      for (const std::size_t user : users_[node])
        if (--waits_for_[user] == 0) nodes.push_back(user);
    }
  }

  /// The first source that is left of a node that is left. There always is one.
  const WaitedFor& source_of(std::size_t node) const {
    return *std::find_if(sources_[node].begin(), sources_[node].end(),
                         [&](const WaitedFor& source) { return is_left_[source.node]; });
  }

  /// A circle that holds the node or that the node waits for. Each node of it waits for the next. It begins with the
  /// node that is first in the file.
  std::vector<std::size_t> circle_before(std::size_t node) const {
    std::vector<std::size_t> path;
    std::map<std::size_t, std::size_t> place;
    for (; place.emplace(node, path.size()).second; node = source_of(node).node) path.push_back(node);
    path.erase(path.begin(), path.begin() + std::ptrdiff_t(place.at(node)));
    std::rotate(path.begin(), std::min_element(path.begin(), path.end()), path.end());
    return path;
  }

 private:
  std::vector<std::vector<WaitedFor>> sources_;
  std::vector<std::vector<std::size_t>> users_;
  std::vector<std::size_t> waits_for_;  ///< number of sources that are left
  std::vector<bool> is_left_;
};

std::vector<std::string> split(const std::string& text) {
  std::vector<std::string> parts;
  std::istringstream stream(text);
  for (std::string part; std::getline(stream, part, '.');) parts.push_back(part);
  if (parts.empty()) parts.emplace_back();
  return parts;
}

/// The index of the output that a node's id alone means: its only output, or its only output of a wanted type. -1 if
/// there is no such output.
int default_output(const std::vector<PortInfo>& outputs, const std::vector<TypeInfo>* types, bool picks_item) {
  if (outputs.size() == 1) return 0;
  if (picks_item || !types) return -1;
  int found = -1;
  for (std::size_t i = 0; i < outputs.size(); ++i)
    if (has_id(*types, outputs[i].type.id)) {
      if (found >= 0) return -1;
      found = int(i);
    }
  return found;
}

}  // namespace

void order_and_find_axes(Pipeline& pipeline, Diagnostics& diagnostics) {
  sort_nodes(pipeline);
  for (std::size_t i = 0; i < pipeline.nodes.size() && diagnostics.empty(); ++i) find_axes(pipeline, i, diagnostics);
  if (!diagnostics.empty()) return;
  for (const PipelineOutput& output : pipeline.outputs) check_picks(pipeline, output.source, diagnostics);
  check_may_fail(pipeline, diagnostics);
}

void check_circles(const WrittenPipeline& written, Diagnostics& diagnostics) {
  WaitingNodes waiting(written);
  for (std::size_t i = 0; i < waiting.count(); ++i)
    while (waiting.is_left(i) && !diagnostics.is_full()) {
      const std::vector<std::size_t> circle = waiting.circle_before(i);
      std::vector<std::string> names, wires;
      for (const std::size_t node : circle) {
        const WaitedFor& source = waiting.source_of(node);
        names.push_back(written.nodes[node].id);
        wires.push_back(names.back() + " takes " + written.nodes[source.node].id + " as " + in_quotes(source.port));
      }
      diagnostics.add(written.nodes[circle[0]].place,
                      circle.size() == 1 ? "node " + in_quotes(names[0]) + " waits for itself"
                                         : "these nodes wait for each other in a circle: " + joined(names, ", "),
                      joined(wires, ", ") + "; leave out one of these wires");
      waiting.take_out(circle);
    }
}

bool has_id(const std::vector<TypeInfo>& types, const std::string& id) {
  return std::any_of(types.begin(), types.end(), [&](const TypeInfo& type) { return type.id == id; });
}

Reference resolve_reference(const std::string& text, const Place& place, const std::vector<TypeInfo>* types,
                            const std::vector<PipelineNode>& nodes, NodeIds& ids, Diagnostics& diagnostics) {
  Reference source{text, place, -1, -1, {}};
  const std::vector<std::string> parts = split(text);
  const std::string& id = parts[0];
  const auto found = ids.index.find(id);
  ids.used.insert(id);
  if (found == ids.index.end()) {
    ids.unknown.insert(id);
    diagnostics.add(place, "there is no node " + in_quotes(id), suggested(diagnostics, id, ids.all));
    return source;
  }
  const std::size_t index = found->second;
  const std::vector<PortInfo>& outputs = nodes[index].info.outputs;
  if (outputs.empty()) return source;  // what the node uses is unknown; this was reported already
  const PortInfo* named = parts.size() > 1 ? find_named(outputs, parts[1]) : nullptr;
  const int output = named ? int(named - outputs.data()) : default_output(outputs, types, parts.size() > 1);
  if (output < 0) {
    if (parts.size() > 1)
      diagnostics.add(place, "node " + in_quotes(id) + " has no output " + in_quotes(parts[1]),
                      suggested(diagnostics, parts[1], names_of(outputs)));
    else
      diagnostics.add(place,
                      "node " + in_quotes(id) + " has several outputs" +
                          (types ? ", and not exactly one of them is " + types_text(*types, "") : ""),
                      "say which: " + id + "." + joined(names_of(outputs), ", "));
    return source;
  }
  source.node = int(index);
  source.output = output;
  source.items.assign(parts.begin() + (named ? 2 : 1), parts.end());
  return source;
}

}  // namespace marrow
