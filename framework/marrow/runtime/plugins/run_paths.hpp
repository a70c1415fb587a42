// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "marrow/runtime/plugins/library.hpp"

namespace marrow {

/// The folders of the run paths (DT_RUNPATH, DT_RPATH) of a loaded library, and of those that it needs, in which the
/// loader looked for a library that was found elsewhere, with the names of the libraries. Folders in LD_LIBRARY_PATH
/// are left out, and libraries that the framework needs, because they were loaded before.
std::vector<SearchedFolder> run_path_folders(void* handle);

}  // namespace marrow
