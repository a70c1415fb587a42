// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <cstddef>
#include <filesystem>
#include <string>
#include <vector>

namespace marrow::compare {

/// Looks for what a pattern such as data/*/ct matches. Unlike glob(3) it says what it could not read, and it ends:
/// links in a circle match without end.
class FolderSearch {
 public:
  /// What is there at `pattern`, sorted; a name that begins with a dot is matched by one only. Throws Error for a
  /// folder that cannot be read, and when all calls together have looked at more than kMostLookedAt files and folders.
  std::vector<std::filesystem::path> matches(const std::filesystem::path& pattern);

  static constexpr std::size_t kMostLookedAt = 300000;

 private:
  std::vector<std::filesystem::path> inside(const std::filesystem::path& folder, const std::string& name);
  void look();

  std::size_t looked_at_ = 0;
};

}  // namespace marrow::compare
