// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <filesystem>
#include <functional>
#include <optional>
#include <string>

#include "marrow/runtime/run/profile.hpp"
#include "marrow/runtime/run/run_folder.hpp"

namespace marrow::cli {

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
