// SPDX-License-Identifier: Apache-2.0
#include "marrow/runtime/plugins/searched_folders.hpp"

#include <sys/stat.h>

#include <algorithm>
#include <unordered_set>

namespace marrow {

namespace fs = std::filesystem;

std::vector<fs::path> files_with_names(const SearchedFolder& folder) {
  const std::unordered_set<std::string> names(folder.names.begin(), folder.names.end());
  std::vector<fs::path> found;
  std::error_code error;
  for (fs::directory_iterator at(folder.path, error), end; !error && at != end; at.increment(error)) {
    const std::string name = at->path().filename().string();
    if (names.contains(name) || names.contains(name.substr(0, name.find('.'))) ||
        names.contains("*" + at->path().extension().string()))
      found.push_back(at->path());
  }
  std::sort(found.begin(), found.end());
  return found;
}

void add_state_of(const std::vector<SearchedFolder>& folders, Hasher& hasher) {
  for (const SearchedFolder& folder : folders) {
    hasher.add(folder.path);
    std::vector<std::string> names = folder.names;
    std::sort(names.begin(), names.end());
    hasher.add(names);
    struct stat status {};
    const bool is_there = stat(folder.path.c_str(), &status) == 0;
    hasher.add(std::uint8_t(is_there));
    if (!is_there) continue;
    if (!S_ISDIR(status.st_mode)) {
      hasher.add(std::int64_t(status.st_size));
      hasher.add(std::int64_t(status.st_mtim.tv_sec)), hasher.add(std::int64_t(status.st_mtim.tv_nsec));
      continue;
    }
    const std::vector<fs::path> files = files_with_names(folder);
    hasher.add(std::uint64_t(files.size()));
    for (const fs::path& file : files) hasher.add(file.filename().string());
  }
}

}  // namespace marrow
