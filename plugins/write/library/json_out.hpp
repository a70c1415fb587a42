// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <nlohmann/json.hpp>
#include <string>

#include "marrow/toolbox/files/atomic_write.hpp"

namespace marrow::write {

/// Writes JSON whole or not at all; `indent` of -1 puts it into one line. Bytes that are not UTF-8 are replaced.
inline void write_json(const std::string& path, const nlohmann::ordered_json& json, int indent = 2) {
  files::write_text(path, json.dump(indent, ' ', false, nlohmann::json::error_handler_t::replace) + "\n");
}

}  // namespace marrow::write
