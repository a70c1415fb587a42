// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <filesystem>

namespace marrow::fuzz {

/// Reads a file with an implant's holes as the node read.implant does.
void read_implant_holes(const std::filesystem::path& path);

}  // namespace marrow::fuzz
