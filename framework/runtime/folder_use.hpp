// SPDX-License-Identifier: Apache-2.0
#pragma once
// Folders of the store that some process works with, so that no other removes them meanwhile. The kernel ends the use
// of a process that dies. Where the file system has no locks, nothing is held.
#include <filesystem>
#include <memory>
#include <system_error>

namespace marrow {

/// Holds the folder for as long as the pointer lives. Empty where there is no folder of that name (any more).
std::shared_ptr<const void> use_folder(const std::filesystem::path& folder);

/// Gives the folder another name, unless somebody holds it: then the error is std::errc::device_or_resource_busy.
void rename_unused(const std::filesystem::path& folder, const std::filesystem::path& to, std::error_code& error);

}  // namespace marrow
