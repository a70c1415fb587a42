// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <filesystem>
#include <optional>
#include <string>

#include "marrow/base/export.hpp"

namespace MARROW_EXPORT marrow {

/// Removes a folder at the end, with what is in it, unless it was renamed before.
class TemporaryFolder {
 public:
  explicit TemporaryFolder(std::filesystem::path made) : path_(std::move(made)) {}
  ~TemporaryFolder();
  TemporaryFolder(const TemporaryFolder&) = delete;
  TemporaryFolder& operator=(const TemporaryFolder&) = delete;
  const std::filesystem::path& path() const { return path_; }

 private:
  std::filesystem::path path_;
};

/// Makes a folder among the system's temporary files: marrow-PURPOSE-XXXXXX. Nobody can predict its name and put files
/// there before, and only this user can access it. Throws Error if it cannot be made.
std::filesystem::path new_temporary_folder(const std::string& purpose);

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
