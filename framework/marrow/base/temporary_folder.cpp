// SPDX-License-Identifier: Apache-2.0
#include "marrow/base/temporary_folder.hpp"

#include <fcntl.h>
#include <sys/stat.h>
#include <cerrno>
#include <cstdlib>
#include <cstring>

#include "marrow/base/error.hpp"

namespace marrow {

TemporaryFolder::~TemporaryFolder() {
  std::error_code ignored;
  std::filesystem::remove_all(path_, ignored);
}

std::filesystem::path new_temporary_folder(const std::string& purpose) {
  const std::filesystem::path folder = std::filesystem::temp_directory_path();
  std::string name = (folder / ("marrow-" + purpose + "-XXXXXX")).string();
  if (!mkdtemp(name.data()))
    throw Error("cannot make a temporary folder in " + folder.string() + ": " + std::strerror(errno) +
                "; name another one in TMPDIR");
  return name;
}

namespace {

namespace fs = std::filesystem;

[[noreturn]] void fail(const fs::path& path, const std::error_code& error) {
  throw Error("the folder " + path.string() + " cannot be emptied: " + error.message());
}

}  // namespace

/// Also true for a bind mount, although it has the same device as the folder around it.
bool is_mount(const fs::path& path) {
  struct statx status {};
  return statx(AT_FDCWD, path.c_str(), AT_SYMLINK_NOFOLLOW | AT_NO_AUTOMOUNT, STATX_TYPE, &status) == 0 &&
         (status.stx_attributes & status.stx_attributes_mask & STATX_ATTR_MOUNT_ROOT);
}

std::optional<fs::path> mount_at_or_below(const fs::path& path) {
  std::error_code error;
  if (is_mount(path)) return path;
  if (!fs::is_directory(fs::symlink_status(path, error))) return std::nullopt;
  for (fs::recursive_directory_iterator at(path, error), end; !error && at != end; at.increment(error))
    if (is_mount(at->path())) return at->path();
  return std::nullopt;
}

void remove_tree(const fs::path& path) {
  if (const auto mount = mount_at_or_below(path))
    throw Error("something is mounted at " + mount->string() + ", where nothing is removed; unmount it");
  std::error_code error;
  fs::remove_all(path, error);
  if (error) fail(path, error);
}

}  // namespace marrow
