// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <filesystem>
#include <string>
#include <vector>

namespace marrow::conformance {

/// Writes a network into the folder, and returns its description: each point's heat map is the bone's brightness
/// itself. It finds nothing well, but a node that runs networks can be called with it.
std::filesystem::path written_network(const std::filesystem::path& folder, const std::vector<std::string>& names);

}  // namespace marrow::conformance
