// SPDX-License-Identifier: Apache-2.0
#include "folder_search.hpp"

#include <fnmatch.h>

#include <algorithm>
#include <climits>

#include "marrow/base/error.hpp"
#include "marrow/base/number_text.hpp"

namespace marrow::compare {

namespace fs = std::filesystem;

bool is_pattern(const std::string& name) { return name.find_first_of("*?[\\") != std::string::npos; }

void FolderSearch::look() {
  if (++looked_at_ > kMostLookedAt)
    throw Error(
        formatted("the search goes through more than {} files and folders; do links lead in a circle?", kMostLookedAt));
}

std::vector<fs::path> FolderSearch::matches(const fs::path& folder, const fs::path& pattern) {
  if (const std::size_t size = (folder / pattern).native().size(); size >= PATH_MAX)
    throw Error(formatted("the path has {} bytes, more than any path may have", size));
  std::vector<fs::path> found{pattern.is_absolute() ? pattern.root_path() : folder};
  for (const fs::path& part : pattern.relative_path()) {
    if (part.empty()) continue;  // the part after a slash at the end
    std::vector<fs::path> next;
    for (const fs::path& one : found) {
      if (is_pattern(part.string())) {
        for (fs::path& match : inside(one, part.string())) next.push_back(std::move(match));
        continue;
      }
      look();
      std::error_code error;
      if (fs::symlink_status(one / part, error).type() != fs::file_type::not_found) next.push_back(one / part);
    }
    found = std::move(next);
  }
  std::sort(found.begin(), found.end());
  return found;
}

std::vector<fs::path> FolderSearch::inside(const fs::path& folder, const std::string& name) {
  std::vector<fs::path> found;
  std::error_code error;
  if (!fs::is_directory(folder, error)) return found;
  fs::directory_iterator at(folder, error);
  for (const fs::directory_iterator end; !error && at != end; at.increment(error)) {
    look();
    if (fnmatch(name.c_str(), at->path().filename().c_str(), FNM_PERIOD) == 0) found.push_back(at->path());
  }
  if (error) throw Error("the folder " + folder.string() + " cannot be read: " + error.message());
  return found;
}

}  // namespace marrow::compare
