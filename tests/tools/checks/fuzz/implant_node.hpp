// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <filesystem>

namespace marrow::fuzz {

/// What the node read.implant does with the file of an implant's holes.
void read_implant_holes(const std::filesystem::path& path);

}  // namespace marrow::fuzz
