// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "marrow/runtime/plugins/library.hpp"

namespace marrow {

/// The folders of run paths (DT_RUNPATH, DT_RPATH) in which the loader looked in vain for what a loaded library needs,
/// directly or indirectly, each with the names of these libraries. Leaves out folders in LD_LIBRARY_PATH, and libraries
/// that the framework needs: they were loaded before.
std::vector<SearchedFolder> run_path_folders(void* handle);

}  // namespace marrow
