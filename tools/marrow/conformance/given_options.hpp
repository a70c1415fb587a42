// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <map>
#include <nlohmann/json.hpp>
#include <string>

#include "marrow/runtime/node/node.hpp"

namespace marrow::cli {

/// Values for the node's options, from the texts that --set gives by the options' names. Other names are left out.
/// Throws Error for a value that does not fit.
std::map<std::string, OptionValue> given_options(const NodeInfo& node, const nlohmann::json& texts);

}  // namespace marrow::cli
