// SPDX-License-Identifier: Apache-2.0
#include "marrow/runtime/pipeline/may_fail.hpp"

#include <set>

#include "marrow/base/printable.hpp"
#include "marrow/runtime/node/relations.hpp"
#include "marrow/runtime/pipeline/pipeline_names.hpp"

namespace marrow {
namespace {

/// "node 'x' failed", if that is why the value or one of its items is missing, and x may fail. Otherwise empty.
std::string failed_in(const Value& value) {
  if (value.is_absent()) return value.may_be_missing ? value.missing : "";
  for (const Value& item : value.items)
    if (std::string failed = failed_in(item); !failed.empty()) return failed;
  return "";
}

/// Whether the node is called for each item along the axis because of this source.
bool gives_items(const Pipeline& pipeline, const PipelineNode& node, const Wire& wire, const Reference& source,
                 const std::string& axis) {
  return node.input_of(wire).axis != axis && contains(pipeline.axes_of(source), axis);
}

/// An axis along which the node is called because of this source, and because of no source that may not fail. Empty if
/// there is no such axis.
std::string own_axis(const Pipeline& pipeline, const PipelineNode& node, const Wire& wire, const Reference& source) {
  for (const std::string& axis : node.mapped_axes) {
    if (!gives_items(pipeline, node, wire, source, axis)) continue;
    bool is_known = false;
    for (const Wire& other : node.wires)
      for (const Reference& from : other.sources)
        is_known |= !pipeline.node_of(from).may_fail && gives_items(pipeline, node, other, from, axis);
    if (!is_known) return axis;
  }
  return "";
}

/// The first relation between the node's inputs and options that does not hold without these inputs; empty if all hold.
std::string broken_without(const PipelineNode& node, const std::set<std::string>& left_out) {
  const auto is_wired = [&](const std::string& name) {
    return !left_out.contains(name) && std::any_of(node.wires.begin(), node.wires.end(),
                                                   [&](const Wire& wire) { return node.input_of(wire).name == name; });
  };
  for (const RelationInfo& relation : node.info.relations)
    if (const auto fault = broken(relation, node.info, node.options, is_wired)) return fault->message;
  return "";
}

}  // namespace

void check_may_fail(const Pipeline& pipeline, Diagnostics& diagnostics) {
  for (const PipelineNode& node : pipeline.nodes) {
    if (node.may_fail) continue;
    for (const Wire& wire : node.wires)
      for (const Reference& source : wire.sources) {
        const PipelineNode& from = pipeline.node_of(source);
        if (!from.may_fail) continue;
        const PortInfo& port = node.input_of(wire);
        const std::string axis = own_axis(pipeline, node, wire, source);
        if (!port.optional)
          diagnostics.add(source.place,
                          "node " + in_quotes(node.id) + " needs input " + in_quotes(port.name) + ", but node " +
                              in_quotes(from.id) + " may fail",
                          "write  may_fail: true  at node " + in_quotes(node.id) +
                              " too, or wire it to an input that may be left out");
        else if (!axis.empty())
          diagnostics.add(source.place,
                          "node " + in_quotes(node.id) + " is called for each " + axis + " of " +
                              in_quotes(source.text) + ", but node " + in_quotes(from.id) + " may fail",
                          "write  may_fail: true  at node " + in_quotes(node.id) + " too");
      }
  }
}

std::string leave_out_failed(const PipelineNode& node, std::vector<Value>& inputs) {
  std::set<std::string> left_out;
  std::string cause;
  for (std::size_t i = 0; i < inputs.size(); ++i) {
    const std::string failed = failed_in(inputs[i]);
    if (failed.empty()) continue;
    const PortInfo& port = node.info.inputs[i];
    if (!port.optional) return "it needs " + in_quotes(port.name) + ", but " + failed;
    inputs[i] = {};
    left_out.insert(port.name);
    if (cause.empty()) cause = failed;
  }
  if (left_out.empty()) return "";
  const std::string fault = broken_without(node, left_out);
  return fault.empty() ? "" : fault + ", because " + cause;
}

void expect_items(const Pipeline& pipeline, const PipelineNode& node, const std::vector<Value>& inputs,
                  const std::string& axis) {
  for (const Wire& wire : node.wires) {
    const std::string failed = failed_in(inputs[std::size_t(wire.port)]);
    if (failed.empty() || !node.input_of(wire).optional) continue;
    for (const Reference& source : wire.sources)
      if (gives_items(pipeline, node, wire, source, axis))
        throw Error("it is called for each " + axis + " of " + in_quotes(source.text) + ", but " + failed);
  }
}

}  // namespace marrow
