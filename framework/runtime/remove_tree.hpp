// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <filesystem>
#include <optional>

namespace marrow {

/// Where another file system, or a folder from elsewhere, is mounted on a path or below it: what that holds is somebody
/// else's. Nothing where nothing is, or where the kernel does not tell.
std::optional<std::filesystem::path> mount_at_or_below(const std::filesystem::path& path);

/// Removes a folder, or a file, with all that is below it; nothing where there is none. Throws Error where that fails,
/// and, with nothing removed, where something is mounted there.
void remove_tree(const std::filesystem::path& path);

}  // namespace marrow
