// SPDX-License-Identifier: Apache-2.0
#pragma once
// The description of a node and of a kind, as JSON and in words.
#include <nlohmann/json_fwd.hpp>
#include <string>

#include "marrow/runtime/node/kind.hpp"
#include "marrow/runtime/node/node.hpp"
#include "marrow/runtime/pipeline/fits.hpp"

namespace marrow::cli {

nlohmann::json node_json(const NodeInfo& node);
/// The contract of a kind, with the limits of its checks.
nlohmann::json kind_json(const KindInfo& kind);
/// {node, fits: "yes", "with more" or "no", missing, faults}
nlohmann::json fit_json(const Fit& fit);
/// "edge_map", "list of view over view".
std::string port_text(const PortInfo& port);
std::string port_text(const KindPort& port);
/// The default of an option, as YAML.
std::string yaml_text(const OptionValue& value);
/// "number, 0 to 100 px", "one of: a, b".
std::string range_text(const OptionInfo& option);
/// What the option replaces, in words; empty if nothing.
std::string replaces_text(const OptionInfo& option);
/// "'low' is not above 'high'".
std::string relation_text(const RelationInfo& relation);

}  // namespace marrow::cli
