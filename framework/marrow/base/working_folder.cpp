// SPDX-License-Identifier: Apache-2.0
#include "marrow/base/working_folder.hpp"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <filesystem>

namespace marrow {

WorkingFolder::WorkingFolder() : descriptor_(open(".", O_PATH | O_DIRECTORY | O_CLOEXEC)) {
  struct stat status {};
  if (!descriptor_.is_open() || fstat(descriptor_, &status) != 0) return;
  device_ = status.st_dev;
  number_ = status.st_ino;
}

std::string WorkingFolder::go_back() const {
  struct stat status {};
  if (!descriptor_.is_open() || (stat(".", &status) == 0 && status.st_dev == device_ && status.st_ino == number_))
    return "";
  std::error_code error;
  const std::filesystem::path elsewhere = std::filesystem::current_path(error);
  if (fchdir(descriptor_) != 0) return "";
  return error ? "a folder that is gone" : elsewhere.string();
}

}  // namespace marrow
