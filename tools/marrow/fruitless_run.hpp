// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <filesystem>

#include "commands.hpp"

namespace marrow::cli {

/// The folder of a run, with a name that marrow chose. If the run makes nothing, this removes it, and its parent if
/// that is new. Otherwise each mistyped input would leave an empty folder.
class FolderOfItsOwn {
 public:
  /// Make this object before the run's folder, which will be in `parent`.
  explicit FolderOfItsOwn(const std::filesystem::path& parent);
  /// The run's folder. Without this call, no folder of a run is removed.
  void take(const std::filesystem::path& folder) { folder_ = folder; }
  /// Keeps the folder, unless the run failed after it had called only nodes without inputs and written nothing. Returns
  /// whether the folder is kept.
  bool keep_if_fruitful(const Pipeline& pipeline, const RunOutcome& outcome);
  /// Removes the folder if nothing was kept, for example because the run threw.
  ~FolderOfItsOwn();

 private:
  std::filesystem::path folder_, parent_;
  bool had_parent_ = false;
};

}  // namespace marrow::cli
