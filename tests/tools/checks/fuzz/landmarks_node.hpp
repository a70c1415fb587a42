// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <filesystem>

namespace marrow::fuzz {

/// Reads a file as the node read.landmarks does.
void read_landmarks(const std::filesystem::path& path);

}  // namespace marrow::fuzz
