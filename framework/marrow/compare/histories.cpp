// SPDX-License-Identifier: Apache-2.0
#include <algorithm>

#include "marrow/compare/cell.hpp"

namespace marrow::compare {
namespace {

bool names_a_path(const NodeInfo& info) {
  for (const OptionInfo& option : info.options)
    if (option.type == OptionType::path || option.type == OptionType::paths) return true;
  return false;
}

/// Whether the node itself depends on the case, by a path or by chance, and not only through its inputs.
bool depends_on_case(const PipelineNode& node) {
  if (!node.repetition) return names_a_path(node.info) || node.info.random;
  const std::vector<const PipelineNode*> called = called_nodes(node.repetition->first);
  return std::any_of(called.begin(), called.end(), [](const PipelineNode* one) { return depends_on_case(*one); });
}

}  // namespace

std::vector<Digest> histories(const Pipeline& pipeline, const std::string& case_name) {
  std::vector<Digest> result;
  for (const PipelineNode& node : pipeline.nodes) {
    Hasher hasher;
    hasher.add(node.info.name);
    for (const OptionValue& option : node.options) std::visit([&](const auto& value) { hasher.add(value); }, option);
    if (node.repetition) hasher.add(resolved_yaml(node.repetition->alone));
    if (depends_on_case(node)) hasher.add(case_name);
    for (const Wire& wire : node.wires)
      for (const Reference& source : wire.sources) {
        hasher.add(node.input_of(wire).name);
        hasher.add(result[std::size_t(source.node)]);
        hasher.add(std::int64_t(source.output));
        hasher.add(source.items);
      }
    result.push_back(hasher.digest());
  }
  return result;
}

std::vector<Dependence> dependences(const Pipeline& pipeline, const Experiment& experiment) {
  const StartProtocol* protocol = experiment.protocol ? &*experiment.protocol : nullptr;
  std::vector<Dependence> result;
  for (const PipelineNode& node : pipeline.nodes) {
    Dependence own{depends_on_case(node),
                   protocol && protocol->node == node.id &&
                       (protocol->rotation_deg > 0 || protocol->translation_mm > 0 || protocol->distance_mm > 0)};
    for (const Wire& wire : node.wires)
      for (const Reference& source : wire.sources) {
        own.on_case |= result[std::size_t(source.node)].on_case;
        own.on_start |= result[std::size_t(source.node)].on_start;
      }
    result.push_back(own);
  }
  return result;
}

}  // namespace marrow::compare
