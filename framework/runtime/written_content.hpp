// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <filesystem>

#include "marrow/runtime/hash.hpp"

namespace marrow {

/// Of the content of a file, or of all files below a folder with their names from there: by it a file that a run wrote
/// is known again, wherever its folder was moved to. Throws Error for what cannot be read.
Digest content_of(const std::filesystem::path& path);

}  // namespace marrow
