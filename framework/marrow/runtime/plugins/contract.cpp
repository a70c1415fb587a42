// SPDX-License-Identifier: Apache-2.0
// Checks nodes against the contracts of their kinds, which other libraries may declare.
#include "marrow/runtime/plugins/contract.hpp"

#include <algorithm>

#include "marrow/base/diagnostics.hpp"
#include "marrow/runtime/node/types.hpp"

namespace marrow {
namespace {

template <class Port>
const Port* find_port(const std::vector<Port>& ports, const std::string& name) {
  const auto found = std::find_if(ports.begin(), ports.end(), [&](const Port& port) { return port.name == name; });
  return found == ports.end() ? nullptr : &*found;
}

/// Checks that each port whose name the kind knows has the type and the axis of the contract.
void check_ports(const std::vector<PortInfo>& ports, const std::vector<KindPort>& contract, const std::string& what,
                 const std::string& kind, std::vector<std::string>& faults) {
  for (const PortInfo& port : ports) {
    const KindPort* known = find_port(contract, port.name);
    if (!known) continue;
    const bool is_one = std::find(known->types.begin(), known->types.end(), port.type) != known->types.end();
    if (is_one && known->axis == port.axis) continue;
    const bool is_old = !is_one && std::any_of(known->types.begin(), known->types.end(),
                                               [&](const TypeInfo& type) { return type.id == port.type.id; });
    faults.push_back(what + " '" + port.name + "': the kind '" + kind + "' has it as " +
                     types_text(known->types, known->axis) + ", not " +
                     (is_old ? "another version of that type; build both again" : types_text({port.type}, port.axis)));
  }
}

void check_traits(const NodeInfo& node, const KindInfo& kind, std::vector<std::string>& faults) {
  std::vector<std::string> known;
  for (const TraitInfo& trait : kind.traits) known.push_back(trait.name);
  for (const std::string& trait : node.traits)
    if (std::find(known.begin(), known.end(), trait) == known.end())
      faults.push_back("trait '" + trait + "': the kind '" + kind.name + "' has none of that name" +
                       (known.empty() ? "" : "; " + suggestion(trait, known)));
}

}  // namespace

std::string types_text(const std::vector<TypeInfo>& types, const std::string& axis) {
  std::string text;
  for (const TypeInfo& type : types) text += (text.empty() ? "" : " or ") + type.id;
  return axis.empty() ? text : "list of " + text + " over " + axis;
}

std::vector<std::string> contract_faults(const NodeInfo& node, const KindInfo* kind) {
  std::vector<std::string> faults;
  if (!kind || !kind->sees_truth)
    for (const PortInfo& port : node.inputs)
      if (port.type.id == TypeInfo::of<Truth>().id)
        faults.push_back("input '" + port.name + "': only nodes of a kind that may see the truth are given it");
  if (!kind) return faults;
  check_ports(node.inputs, kind->inputs, "input", kind->name, faults);
  check_ports(node.outputs, kind->outputs, "output", kind->name, faults);
  for (const KindPort& port : kind->outputs)
    if (!find_port(node.outputs, port.name))
      faults.push_back("output '" + port.name + "' is missing: every node of the kind '" + kind->name + "' has it");
  check_traits(node, *kind, faults);
  return faults;
}

}  // namespace marrow
