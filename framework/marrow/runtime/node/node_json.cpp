// SPDX-License-Identifier: Apache-2.0
#include "marrow/runtime/node/node_json.hpp"

#include <nlohmann/json.hpp>

namespace marrow {

nlohmann::json json_of(const OptionValue& value) {
  return std::visit([](const auto& v) { return nlohmann::json(v); }, value);
}

}  // namespace marrow
