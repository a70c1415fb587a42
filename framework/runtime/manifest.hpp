// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <nlohmann/json.hpp>

#include "marrow/runtime/library.hpp"

namespace marrow {

nlohmann::json json_of(const OptionValue& value);
nlohmann::json json_of(const NodeInfo& node);
/// The whole description, with a checksum over the rest, so that an edited one is noticed.
std::string manifest_text(const LibraryInfo& info);
/// Throws Error saying what is wrong with the text.
LibraryInfo manifest_from_text(const std::string& text);

const char* option_type_name(OptionType type);

}  // namespace marrow
