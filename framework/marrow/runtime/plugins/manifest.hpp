// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <nlohmann/json.hpp>

#include "marrow/runtime/node/relations.hpp"
#include "marrow/runtime/plugins/library.hpp"

namespace MARROW_EXPORT_TO_TESTS marrow {

nlohmann::json json_of(const NodeInfo& node);

/// The whole description, for a manifest and for other processes.
nlohmann::json library_json(const LibraryInfo& info);
/// Every type, range and default is checked, so that a library could have registered what is returned. Throws Error,
/// with a text that begins with "it", for any other document.
LibraryInfo library_from_json(const nlohmann::json& document);

constexpr std::size_t kMostManifest_bytes = 4 << 20;
/// The text of a manifest.
std::string manifest_text(const LibraryInfo& info);
/// Reads the text of a manifest. Throws as library_from_json() does.
LibraryInfo manifest_from_text(const std::string& text);
/// The text of an object, with a checksum of the text that follows it, so that an edited manifest is noticed.
std::string with_checksum(const nlohmann::json& document);

/// Reads the nodes that a Python process declares, a list of json_of(). They are checked as strictly as a manifest.
LibraryInfo info_of_nodes(const nlohmann::json& nodes);

/// The first difference between what a library registers and its description, with both values; empty if there is none.
/// Does not compare the file of the library, or the libraries that it links.
std::string difference(const LibraryInfo& described, const LibraryInfo& registered);

}  // namespace marrow
