// SPDX-License-Identifier: Apache-2.0
#include "lacking.hpp"

#include <algorithm>
#include <cstdio>

#include "marrow/base/printable.hpp"

namespace marrow::cli {
namespace {

using Status = NodeRecord::Status;

/// The first needed input of a skipped node for which nothing came; nullptr if there is none.
const Wire* lacking_wire(const Pipeline& pipeline, const RunResult& result, std::size_t node) {
  for (const Wire& wire : pipeline.nodes[node].wires) {
    const bool is_needed = wire.port >= 0 && !pipeline.nodes[node].info.inputs[std::size_t(wire.port)].optional;
    const auto is_absent = [&](const Reference& source) { return value_of(result, source).is_absent(); };
    if (is_needed && !wire.sources.empty() && std::all_of(wire.sources.begin(), wire.sources.end(), is_absent))
      return &wire;
  }
  return nullptr;
}

std::string node_text(const PipelineNode& node) { return "node '" + node.id + "' (" + node.info.name + ")"; }

std::string lack_of(const Pipeline& pipeline, const RunResult& result, const PipelineOutput& output) {
  std::size_t node = std::size_t(output.source.node);
  for (bool is_first = true; result.nodes[node].status == Status::skipped; is_first = false) {
    const Wire* wire = lacking_wire(pipeline, result, node);
    if (!wire) return "";
    const std::size_t source = std::size_t(wire->sources[0].node);
    if (result.nodes[source].status != Status::skipped)
      return is_first || result.nodes[source].status != Status::done
                 ? ""
                 : node_text(pipeline.nodes[node]) + " needs '" +
                       pipeline.nodes[node].info.inputs[std::size_t(wire->port)].name + "', which " +
                       node_text(pipeline.nodes[source]) + " does not give";
    node = source;
  }
  return "";
}

}  // namespace

std::map<std::string, std::vector<std::string>> lacking_outputs(const Pipeline& pipeline, const RunResult& result) {
  std::map<std::string, std::vector<std::string>> outputs;
  for (const PipelineOutput& output : pipeline.outputs)
    if (const std::string reason = lack_of(pipeline, result, output); !reason.empty())
      outputs[reason].push_back(output.name);
  return outputs;
}

void print_lacking_outputs(const Pipeline& pipeline, const RunResult& result) {
  for (const auto& [reason, outputs] : lacking_outputs(pipeline, result)) {
    std::string names;
    for (const std::string& name : outputs) names += (names.empty() ? "" : ", ") + name;
    std::printf("  %s: not there because %s\n", printable(names).c_str(), printable(reason).c_str());
  }
}

}  // namespace marrow::cli
