// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <filesystem>

namespace marrow::fuzz {

/// What the node read.landmarks does with a file.
void read_landmarks(const std::filesystem::path& path);

}  // namespace marrow::fuzz
