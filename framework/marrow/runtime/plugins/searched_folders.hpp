// SPDX-License-Identifier: Apache-2.0
#pragma once
// Folders in which the files of a plugin were looked for: a file that appears there may be loaded instead of another.
#include "marrow/runtime/plugins/library.hpp"

namespace marrow {

/// The files in the folder that have one of its names, sorted. None if there is no such folder.
std::vector<std::filesystem::path> files_with_names(const SearchedFolder& folder);

/// Adds the folders in their order, the names, and which files with these names each of them has now. An archive in the
/// place of a folder counts with its size and time.
void add_state_of(const std::vector<SearchedFolder>& folders, Hasher& hasher);

}  // namespace marrow
