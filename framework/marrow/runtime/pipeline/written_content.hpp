// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <filesystem>

#include "marrow/base/export.hpp"
#include "marrow/base/hash.hpp"

namespace MARROW_EXPORT marrow {

/// Digest of the content of a file, or of all files below a folder with their relative names. It identifies what a run
/// wrote, even if the folder was moved. Throws Error if something cannot be read.
Digest content_of(const std::filesystem::path& path);

}  // namespace marrow
