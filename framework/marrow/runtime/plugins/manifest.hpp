// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <nlohmann/json.hpp>

#include "marrow/base/export.hpp"
#include "marrow/runtime/node/node_json.hpp"
#include "marrow/runtime/plugins/library.hpp"

namespace MARROW_EXPORT_TO_TESTS marrow {

nlohmann::json json_of(const NodeInfo& node);
/// The text of a manifest: the whole description, with a checksum by which an edited manifest is noticed.
std::string manifest_text(const LibraryInfo& info);
constexpr std::size_t kMostManifest_bytes = 4 << 20;
/// Reads the text of a manifest. Every type, range and default is checked, so that a library could have registered what
/// is returned. Throws Error, with a text that begins with "it", for any other text.
LibraryInfo manifest_from_text(const std::string& text);

/// What a process that is no library says about its nodes, a list of json_of(). It is checked as strictly as a
/// manifest.
LibraryInfo info_of_nodes(const nlohmann::json& nodes);

/// The first difference between what a library registers and its description, with both values; empty if there is none.
/// The files of the library, and of those that it links, are not compared.
std::string difference(const LibraryInfo& described, const LibraryInfo& registered);

}  // namespace marrow
