// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <nlohmann/json.hpp>

#include "marrow/runtime/library.hpp"

namespace marrow {

nlohmann::json json_of(const OptionValue& value);
nlohmann::json json_of(const NodeInfo& node);
/// The whole description, with a checksum over the rest, so that an edited one is noticed.
std::string manifest_text(const LibraryInfo& info);
constexpr std::size_t kMostManifest_bytes = 4 << 20;
/// What it returns could have been registered by a library: every type, range and default is checked. Throws Error,
/// which begins with "it", for any other text.
LibraryInfo manifest_from_text(const std::string& text);

/// The first thing in which what a library registers is not what its description says, with both values; empty when
/// there is none. The files that it was described with do not count.
std::string difference(const LibraryInfo& described, const LibraryInfo& registered);

const char* option_type_name(OptionType type);

}  // namespace marrow
