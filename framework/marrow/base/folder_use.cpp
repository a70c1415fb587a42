// SPDX-License-Identifier: Apache-2.0
#include "marrow/base/folder_use.hpp"

#include <fcntl.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>

namespace marrow {
namespace {

namespace fs = std::filesystem;

/// An open folder. Closing it releases its locks.
struct OpenFolder {
  explicit OpenFolder(const fs::path& folder)
      : descriptor(open(folder.c_str(), O_RDONLY | O_DIRECTORY | O_NOFOLLOW | O_CLOEXEC)) {}
  ~OpenFolder() {
    if (descriptor >= 0) close(descriptor);
  }
  OpenFolder(const OpenFolder&) = delete;
  OpenFolder& operator=(const OpenFolder&) = delete;

  int descriptor;
};

bool is_still(const OpenFolder& open_folder, const fs::path& folder) {
  struct stat held {
  }, named{};
  return fstat(open_folder.descriptor, &held) == 0 && lstat(folder.c_str(), &named) == 0 &&
         held.st_dev == named.st_dev && held.st_ino == named.st_ino;
}

}  // namespace

std::shared_ptr<const void> use_folder(const fs::path& folder) {
  auto held = std::make_shared<OpenFolder>(folder);
  if (held->descriptor < 0) return nullptr;
  // This wait is short: a process that removes a folder locks it only while it renames it.
  while (flock(held->descriptor, LOCK_SH) != 0 && errno == EINTR) continue;
  return is_still(*held, folder) ? held : nullptr;
}

void rename_unused(const fs::path& folder, const fs::path& to, std::error_code& error) {
  const OpenFolder held(folder);
  const bool is_gone = held.descriptor < 0 && errno == ENOENT;
  if (held.descriptor >= 0 && flock(held.descriptor, LOCK_EX | LOCK_NB) != 0 && errno == EWOULDBLOCK) {
    error = std::make_error_code(std::errc::device_or_resource_busy);
    return;
  }
  // If it was gone, or another process renamed it until it was locked, a new one may be there, which is not locked.
  if (is_gone || (held.descriptor >= 0 && !is_still(held, folder))) {
    error = std::make_error_code(std::errc::no_such_file_or_directory);
    return;
  }
  fs::rename(folder, to, error);
}

}  // namespace marrow
