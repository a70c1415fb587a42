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

/// When the file was written, in UTC: "2026-01-31T12:00:00Z". Empty if that cannot be read.
std::string time_of_file(const std::filesystem::path& file);

// Files in .marrow/drafts with parts of a draft that pipelines read: masks, cameras, points. A file is named after the
// digest of its content, so it never changes.

/// Writes the text to .marrow/drafts/NAME-DIGEST.ENDING, with the digest of the text, and returns the path.
std::filesystem::path working_file(const OpenedFolder& folder, const std::string& name, const std::string& ending,
                                   const std::string& text);

/// Removes files that were not used in the last day and that no step of a draft names: undo may lead back to any step.
/// If a draft cannot be read, all files stay.
void remove_unused_working_files(const OpenedFolder& folder);

}  // namespace marrow::workbench
