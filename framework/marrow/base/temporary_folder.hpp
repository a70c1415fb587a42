// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <filesystem>
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

}  // namespace marrow
