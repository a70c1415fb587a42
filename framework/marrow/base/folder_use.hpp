// SPDX-License-Identifier: Apache-2.0
#pragma once
// Marks folders of the store as used, so that no other process removes them. If a process dies, the kernel ends its
// use. On file systems without locks, this has no effect.
#include <filesystem>
#include <memory>
#include <system_error>

#include "marrow/base/export.hpp"

namespace MARROW_EXPORT marrow {

/// Holds the folder as long as the returned pointer lives. Returns nullptr if the folder does not exist (any more).
std::shared_ptr<const void> use_folder(const std::filesystem::path& folder);

/// Renames the folder, unless a process holds it: then `error` is std::errc::device_or_resource_busy.
void rename_unused(const std::filesystem::path& folder, const std::filesystem::path& to, std::error_code& error);

}  // namespace marrow
