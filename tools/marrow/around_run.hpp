// SPDX-License-Identifier: Apache-2.0
#pragma once
// What the commands that run a pipeline do before and after the run itself.
#include <filesystem>
#include <functional>
#include <map>
#include <optional>
#include <string>
#include <vector>

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

/// Outputs that were not made although no node failed, by the reason: "node 'bone' (its type) needs 'seeds', which node
/// 'case' (its type) does not give". An output is left out of it if only its own node lacks something, as a figure that
/// needs a truth: it is there only for data that have one.
std::map<std::string, std::vector<std::string>> lacking_outputs(const Pipeline& pipeline, const RunResult& result);

/// Prints a line for each reason.
void print_lacking_outputs(const Pipeline& pipeline, const RunResult& result);

/// The profile of a run that --profile asks for; nothing if `file` is empty.
class ProfileOfRun {
 public:
  /// From now on, a run with these settings is noted here.
  ProfileOfRun(const std::filesystem::path& file, RunSettings& settings);
  /// Writes the file, and for the run's page the same as profile.json in its folder. False, with a message, if it
  /// cannot be written. `note` is told if bars were left out.
  bool write(const std::string& title, const RunFolder& folder,
             const std::function<void(const std::string&)>& note) const;

 private:
  std::filesystem::path file_;
  std::optional<Profile> profile_;
};

}  // namespace marrow::cli
