// SPDX-License-Identifier: Apache-2.0
#include "marrow/base/folder_use.hpp"

#include <fcntl.h>
#include <sys/file.h>
#include <sys/stat.h>

#include <cerrno>

#include "marrow/base/descriptor.hpp"

namespace marrow {
namespace {

namespace fs = std::filesystem;

/// Closing it releases its locks.
Descriptor open_folder(const fs::path& folder) {
  return Descriptor(open(folder.c_str(), O_RDONLY | O_DIRECTORY | O_NOFOLLOW | O_CLOEXEC));
}

bool is_still(const Descriptor& opened, const fs::path& folder) {
  struct stat held {
  }, named{};
  return fstat(opened, &held) == 0 && lstat(folder.c_str(), &named) == 0 && held.st_dev == named.st_dev &&
         held.st_ino == named.st_ino;
}

}  // namespace

std::shared_ptr<const void> use_folder(const fs::path& folder) {
  const auto held = std::make_shared<Descriptor>(open_folder(folder));
  if (!held->is_open()) return nullptr;
  // This wait is short: a process that removes a folder locks it only while it renames it.
  while (flock(*held, LOCK_SH) != 0 && errno == EINTR) continue;
  return is_still(*held, folder) ? held : nullptr;
}

void rename_unused(const fs::path& folder, const fs::path& to, std::error_code& error) {
  const Descriptor held = open_folder(folder);
  const bool is_gone = !held.is_open() && errno == ENOENT;
  if (held.is_open() && flock(held, LOCK_EX | LOCK_NB) != 0 && errno == EWOULDBLOCK) {
    error = std::make_error_code(std::errc::device_or_resource_busy);
    return;
  }
  // If it was missing, or another process renamed it before it was locked, a new folder without a lock may have its
  // name.
  if (is_gone || (held.is_open() && !is_still(held, folder))) {
    error = std::make_error_code(std::errc::no_such_file_or_directory);
    return;
  }
  fs::rename(folder, to, error);
}

}  // namespace marrow
