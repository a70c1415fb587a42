// SPDX-License-Identifier: Apache-2.0
#pragma once
// What is known of a node, as JSON and in words.
#include <nlohmann/json_fwd.hpp>
#include <string>

#include "marrow/runtime/kind.hpp"
#include "marrow/runtime/node.hpp"

namespace marrow::cli {

nlohmann::json node_json(const NodeInfo& node);
/// "edge_map", "list of view over view".
std::string port_text(const PortInfo& port);
std::string port_text(const KindPort& port);
/// An option's default as it is written in YAML.
std::string yaml_text(const OptionValue& value);
/// "number, 0 to 100 px", "one of: a, b".
std::string range_text(const OptionInfo& option);

}  // namespace marrow::cli
