// SPDX-License-Identifier: Apache-2.0
#pragma once
// Readers that are nodes, each in a file of its own because every node calls its options Options.
#include <filesystem>

namespace marrow::fuzz {

void read_implant_holes(const std::filesystem::path& path);
void read_landmarks(const std::filesystem::path& path);
void read_track(const std::filesystem::path& path);

}  // namespace marrow::fuzz
