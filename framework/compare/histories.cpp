// SPDX-License-Identifier: Apache-2.0
#include "marrow/compare/cell.hpp"

namespace marrow::compare {

std::vector<Digest> histories(const Pipeline& pipeline, const std::string& case_name) {
  std::vector<Digest> result;
  for (const PipelineNode& node : pipeline.nodes) {
    Hasher hasher;
    hasher.add(node.info.name);
    bool names_a_path = false;
    for (std::size_t i = 0; i < node.options.size(); ++i) {
      const OptionType type = node.info.options[i].type;
      names_a_path |= type == OptionType::path || type == OptionType::paths;
      std::visit([&](const auto& value) { hasher.add(value); }, node.options[i]);
    }
    if (names_a_path || node.info.random) hasher.add(case_name);
    for (const Wire& wire : node.wires)
      for (const Reference& source : wire.sources) {
        hasher.add(node.info.inputs[std::size_t(wire.port)].name);
        hasher.add(result[std::size_t(source.node)]);
        hasher.add(std::int64_t(source.output));
        hasher.add(source.items);
      }
    result.push_back(hasher.digest());
  }
  return result;
}

}  // namespace marrow::compare
