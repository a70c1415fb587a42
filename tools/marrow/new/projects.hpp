// SPDX-License-Identifier: Apache-2.0
#pragma once
// New nodes and kinds. Each function throws Error if the request cannot be met; then nothing is written.
#include <filesystem>
#include <string>

namespace marrow::cli {

/// Makes a folder with a node KIND.NAME, its test and a comparison. Empty `folder`: KIND_NAME here. Returns the folder.
std::filesystem::path new_node(const std::string& name, const std::filesystem::path& folder);
/// The same with a node in Python, which needs no build.
std::filesystem::path new_python_node(const std::string& name, const std::filesystem::path& folder);
/// Makes a folder with a kind, its checks and two nodes, as docs/example-kind has them.
std::filesystem::path new_kind(const std::string& name, const std::filesystem::path& folder);

}  // namespace marrow::cli
