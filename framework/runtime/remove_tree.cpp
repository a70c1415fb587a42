// SPDX-License-Identifier: Apache-2.0
#include "remove_tree.hpp"

#include <fcntl.h>
#include <sys/stat.h>

#include "marrow/domain/error.hpp"

namespace marrow {
namespace {

namespace fs = std::filesystem;

/// Of a bind mount too, whose device is that of the folder around it.
void refuse_mount(const fs::path& path) {
  struct statx status {};
  if (statx(AT_FDCWD, path.c_str(), AT_SYMLINK_NOFOLLOW | AT_NO_AUTOMOUNT, STATX_TYPE, &status) != 0) return;
  if (status.stx_attributes & status.stx_attributes_mask & STATX_ATTR_MOUNT_ROOT)
    throw Error("something is mounted at " + path.string() + ", where nothing is removed; unmount it");
}

[[noreturn]] void fail(const fs::path& path, const std::error_code& error) {
  throw Error("the folder " + path.string() + " cannot be emptied: " + error.message());
}

}  // namespace

void remove_tree(const fs::path& path) {
  std::error_code error;
  refuse_mount(path);
  if (fs::symlink_status(path, error).type() == fs::file_type::directory) {
    fs::recursive_directory_iterator at(path, error);
    for (const fs::recursive_directory_iterator end; !error && at != end; at.increment(error)) refuse_mount(at->path());
    if (error) fail(path, error);
  }
  fs::remove_all(path, error);
  if (error) fail(path, error);
}

}  // namespace marrow
