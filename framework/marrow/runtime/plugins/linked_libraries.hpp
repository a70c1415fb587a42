// SPDX-License-Identifier: Apache-2.0
#pragma once
// The libraries that a plugin needs. They can change its results as much as its own code can.
#include "marrow/runtime/plugins/library.hpp"

namespace MARROW_EXPORT marrow {

/// The libraries that a loaded library needs, with the files that were loaded: those that it links itself, and those
/// that they need in turn. The framework is left out. Libraries that the framework needs (framework_libraries()) are
/// left out too, unless the library links them itself.
std::vector<LinkedLibrary> linked_libraries(void* handle);

/// The libraries that would be loaded with a library, as the system's loader lists them: with full paths, and without
/// running their code. Empty if it lists none, for example because one of them is missing.
std::vector<std::filesystem::path> libraries_to_load(const std::filesystem::path& library);

/// The libraries that the framework needs in this process, directly or indirectly.
const std::vector<LinkedLibrary>& framework_libraries();

std::vector<std::filesystem::path> paths_of(const std::vector<LinkedLibrary>& libraries);

/// Whether a file, given with its full path, is in a folder of the system's packages.
bool is_of_the_system(const std::string& file);

/// The identity of a library. It includes the name of the file. For a library of the system, it also includes the size
/// and the GNU build id, which each build gets; if there is no build id, the time of the file. For a library that
/// people build themselves, it includes the content. Throws Error if the file cannot be read.
Digest identity_of(const LinkedLibrary& library);

/// The identities of framework_libraries(), computed once: what this process has loaded does not change.
const std::vector<Digest>& framework_identities();

/// Another file in LD_LIBRARY_PATH that has the same name up to the version; empty if there is none. The loader may
/// prefer that file.
std::string found_before(const LinkedLibrary& library);

/// Digest of what the loader searches first: LD_LIBRARY_PATH, LD_PRELOAD, and the names of the libraries in
/// LD_LIBRARY_PATH.
Digest search_digest();

}  // namespace marrow
