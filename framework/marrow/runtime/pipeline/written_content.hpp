// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <filesystem>

#include "marrow/base/export.hpp"
#include "marrow/base/hash.hpp"

namespace MARROW_EXPORT marrow {

/// Digest of the content of a file, or of all files below a folder and their relative names. By it, what a run wrote is
/// recognised even in a folder that was moved. Throws Error if something cannot be read.
Digest content_of(const std::filesystem::path& path);

}  // namespace marrow
