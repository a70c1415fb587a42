// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <filesystem>

namespace marrow {

/// Removes a folder, or a file, with all that is below it; nothing where there is none. Throws Error where that fails, and,
/// with nothing removed, where something is mounted there: what is in it is somebody else's.
void remove_tree(const std::filesystem::path& path);

}  // namespace marrow
