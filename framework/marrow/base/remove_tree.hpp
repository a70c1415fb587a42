// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <filesystem>
#include <optional>

#include "marrow/base/export.hpp"

namespace MARROW_EXPORT marrow {

/// Whether another file system, or a folder from elsewhere, is mounted exactly at a path. False if the kernel does not
/// tell.
bool is_mount(const std::filesystem::path& path);

/// The place where another file system, or a folder from elsewhere, is mounted on a path or below it. What is there
/// belongs to somebody else. Returns nothing if nothing is mounted, or if the kernel does not tell.
std::optional<std::filesystem::path> mount_at_or_below(const std::filesystem::path& path);

/// Removes a folder or a file with everything below it. Does nothing if it does not exist. Throws Error if that fails.
/// If something is mounted there, throws Error and removes nothing.
void remove_tree(const std::filesystem::path& path);

}  // namespace marrow
