// SPDX-License-Identifier: Apache-2.0
#pragma once
// The folder that `marrow open` was given. Nothing outside it is read or written.
#include <filesystem>
#include <nlohmann/json.hpp>
#include <string>

namespace marrow::workbench {

class OpenedFolder {
 public:
  /// Throws Error if it is no folder that can be read.
  explicit OpenedFolder(const std::filesystem::path& folder);

  const std::filesystem::path& path() const { return folder_; }
  /// The place of a path relative to the folder, with links resolved; "" is the folder itself. It need not exist.
  /// Throws Error if the path leads out of the folder.
  std::filesystem::path inside(const std::string& relative) const;
  /// The path relative to the folder, with '/'.
  std::string relative(const std::filesystem::path& path) const;

  /// {path, folders: [name], files: [{name, bytes}]} of a folder, each sorted by name. Hidden ones are left out.
  nlohmann::json listing(const std::string& relative) const;
  /// What the folder offers, at most four folders deep: {cases, pipelines, experiments, runs, comparisons}, each a
  /// sorted list of relative paths. `is_cut`: there are too many files to look at all of them.
  nlohmann::json contents() const;

 private:
  std::filesystem::path folder_;  ///< absolute, links resolved
};

}  // namespace marrow::workbench
