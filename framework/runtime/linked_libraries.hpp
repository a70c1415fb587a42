// SPDX-License-Identifier: Apache-2.0
#pragma once
// The libraries that a plugin needs, which change its results as much as its own code does.
#include "marrow/runtime/library.hpp"

namespace marrow {

/// What a loaded library needs, with the files that were loaded: what it links itself, and what that needs in turn.
/// Without the framework, and without what only the framework needs: framework_libraries() are those.
std::vector<LinkedLibrary> linked_libraries(void* handle);

/// What the framework needs in this process, directly or not.
const std::vector<LinkedLibrary>& framework_libraries();

/// Packages are told apart by the number that each build of a library gets (its GNU build id), where one has none by
/// size and time. What people build themselves counts by its content. The file's name is part of it.
Digest identity_of(const LinkedLibrary& library);

/// Where LD_LIBRARY_PATH holds another file of the same name, up to the version; else empty. The loader may prefer
/// that.
std::string found_before(const LinkedLibrary& library);

/// Of what the loader searches first: LD_LIBRARY_PATH, LD_PRELOAD and which libraries there are.
Digest search_digest();

}  // namespace marrow
