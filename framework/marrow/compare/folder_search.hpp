// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <cstddef>
#include <filesystem>
#include <string>
#include <vector>

namespace marrow::compare {

/// Whether a name of a path holds a wildcard.
bool is_pattern(const std::string& name);

/// Finds the paths that match a pattern such as data/*/ct. Unlike glob(3), it says what it could not read, and it ends
/// even if links form a circle.
class FolderSearch {
 public:
  /// The existing paths that match `pattern`, sorted. The search starts at `folder`, whose name is not a pattern even
  /// if it holds a '*'. A name that begins with a dot is matched only by a pattern that begins with a dot. Throws Error
  /// if a folder cannot be read, if the path is longer than any may be, or if all calls together have looked at more
  /// than kMostLookedAt files and folders.
  std::vector<std::filesystem::path> matches(const std::filesystem::path& folder, const std::filesystem::path& pattern);

  static constexpr std::size_t kMostLookedAt = 300000;

 private:
  std::vector<std::filesystem::path> inside(const std::filesystem::path& folder, const std::string& name);
  void look();

  std::size_t looked_at_ = 0;
};

}  // namespace marrow::compare
