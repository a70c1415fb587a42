// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <filesystem>

#include "commands.hpp"

namespace marrow::cli {

/// A folder that marrow itself named for a run. If the run makes nothing, the folder is removed again, with those above
/// it that did not exist before: a mistyped input would leave one empty folder after the other.
class FolderOfItsOwn {
 public:
  /// To be made before the run's folder, which will be in `parent`.
  explicit FolderOfItsOwn(const std::filesystem::path& parent);
  /// The run's folder. Without this call, no folder of a run is removed.
  void take(const std::filesystem::path& folder) { folder_ = folder; }
  /// Keeps the folder, unless the run failed when it had called only nodes without inputs and written nothing. Returns
  /// whether it is kept.
  bool keep_if_fruitful(const Pipeline& pipeline, const RunOutcome& outcome);
  /// Removes the folder if nothing was kept, for example because the run threw.
  ~FolderOfItsOwn();

 private:
  std::filesystem::path folder_, parent_;
  bool had_parent_ = false;
};

}  // namespace marrow::cli
