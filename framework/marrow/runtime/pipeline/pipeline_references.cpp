// SPDX-License-Identifier: Apache-2.0
// References to nodes and their outputs, as written in a pipeline.
#include "marrow/runtime/pipeline/pipeline_references.hpp"

#include <algorithm>
#include <sstream>

#include "marrow/base/printable.hpp"
#include "marrow/runtime/node/types.hpp"
#include "marrow/runtime/pipeline/pipeline_names.hpp"
#include "marrow/runtime/pipeline/renamed.hpp"
#include "marrow/runtime/plugins/contract.hpp"

namespace marrow {
namespace {

std::vector<std::string> split(const std::string& text) {
  std::vector<std::string> parts;
  std::istringstream stream(text);
  for (std::string part; std::getline(stream, part, '.');) parts.push_back(part);
  if (parts.empty()) parts.emplace_back();
  return parts;
}

/// The output that a node's name alone means: its only output, or the only one of the wanted types. -1 if there is
/// none.
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

bool has_id(const std::vector<TypeInfo>& types, const std::string& id) {
  return std::any_of(types.begin(), types.end(), [&](const TypeInfo& type) { return type.id == id; });
}

Reference resolve_reference(const std::string& text, const Place& place, const std::vector<TypeInfo>* types,
                            const std::vector<PipelineNode>& nodes, NodeIds& ids, Diagnostics& diagnostics) {
  Reference source{text, place, -1, -1, {}};
  const std::vector<std::string> parts = split(text);
  const std::string id = parts.empty() ? text : parts[0];
  const auto found = ids.index.find(id);
  ids.used.insert(id);
  if (found == ids.index.end()) {
    ids.unknown.insert(id);
    diagnostics.add(place, "there is no node " + in_quotes(id), suggested(diagnostics, id, ids.all));
    return source;
  }
  const std::size_t index = found->second;
  const std::vector<PortInfo>& outputs = nodes[index].info.outputs;
  if (outputs.empty()) return source;  // its node is unknown; this was already reported
  std::size_t used = 1;
  int output = -1;
  for (std::size_t i = 0; i < outputs.size(); ++i)
    if (parts.size() > 1 && outputs[i].name == parts[1]) output = int(i);
  if (output >= 0) {
    used = 2;
  } else {
    output = default_output(outputs, types, parts.size() > 1);
  }
  if (output < 0) {
    if (parts.size() > 1)
      diagnostics.add(place, "node " + in_quotes(parts[0]) + " has no output " + in_quotes(parts[1]),
                      suggested_for(nodes[index].info.name, parts[1], names_of(outputs), diagnostics));
    else
      diagnostics.add(place,
                      "node " + in_quotes(parts[0]) + " has several outputs" +
                          (types ? " and not just one " + types_text(*types, "") : ""),
                      "say which: " + parts[0] + "." + joined(names_of(outputs), ", "));
    return source;
  }
  source.node = int(index);
  source.output = output;
  source.items.assign(parts.begin() + std::ptrdiff_t(used), parts.end());
  return source;
}

}  // namespace marrow
