// SPDX-License-Identifier: Apache-2.0
#pragma once
// The files that a watched pipeline depends on.
#include <filesystem>
#include <map>
#include <string>
#include <vector>

#include "commands.hpp"

namespace marrow::cli {

/// When each file was written last, and its size. Two states differ if anything was changed, added or removed.
using FileStates = std::map<std::filesystem::path, std::pair<std::filesystem::file_time_type, std::uintmax_t>>;

/// The files that a pipeline depends on. If it has a fault: those that could still be found.
struct WatchedFiles {
  std::vector<std::filesystem::path> paths;           ///< its file, those of its bodies, and what its options name
  std::vector<std::filesystem::path> plugin_folders;  ///< whose libraries are used
};
WatchedFiles files_of(const PipelineRequest& request);

/// The states of the files, of all files below the folders, and of the libraries of plugins. Leaves out what does not
/// exist or cannot be read.
FileStates states_of(const WatchedFiles& files);

/// A CMake build folder and the sources from which it is built.
struct WatchedBuild {
  std::filesystem::path folder, sources;
};
/// Throws Error if the folder is no build folder of CMake.
WatchedBuild watched_build(const std::filesystem::path& folder);

/// The states of the sources: everything below their folder except build folders, hidden ones and folders of runs.
FileStates states_of_sources(const WatchedBuild& build);

}  // namespace marrow::cli
