// SPDX-License-Identifier: Apache-2.0
#include "marrow/runtime/pipeline/pipeline_resolved.hpp"

#include <algorithm>
#include <sstream>

#include "marrow/base/printable.hpp"
#include "marrow/runtime/node/types.hpp"
#include "marrow/runtime/pipeline/pipeline_names.hpp"
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
