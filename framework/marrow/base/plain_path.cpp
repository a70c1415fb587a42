// SPDX-License-Identifier: Apache-2.0
#include "marrow/base/plain_path.hpp"

#include <algorithm>

namespace marrow {

namespace fs = std::filesystem;

fs::path plain_path(const fs::path& path) {
  if (std::find(path.begin(), path.end(), "..") == path.end()) return path.lexically_normal();
  fs::path plain = path.root_path();
  for (const fs::path& part : path.relative_path()) {
    const bool is_up = part == "..", is_root = plain.has_root_directory() && !plain.has_relative_path();
    if (part.empty() || part == "." || (is_up && is_root)) continue;  // the parent of the root is the root
    std::error_code error;
    const bool goes_with_it = is_up && plain.filename() != ".." && fs::is_directory(fs::symlink_status(plain, error));
    if (goes_with_it)
      plain = plain.parent_path();
    else
      plain /= part;
  }
  const fs::path shortest = path.lexically_normal();
  if (plain.empty()) return shortest.empty() ? plain : ".";
  return !shortest.has_filename() && plain.has_filename() ? plain / "" : plain;
}

}  // namespace marrow
