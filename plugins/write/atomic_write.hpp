// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <filesystem>
#include <functional>
#include <string>

namespace marrow::write {

/// Calls `fill` with a temporary name beside `path` that ends in the same extension, then renames what it made to
/// `path`. On any failure the temporary file or folder is removed, `path` is as it was before, and Error names it.
void write_atomically(const std::filesystem::path& path, const std::function<void(const std::filesystem::path&)>& fill);

/// Writes text in this way.
void write_text(const std::filesystem::path& path, const std::string& text);

/// Writes text under this very name; throws Error when not all of it could be written.
void write_text_plainly(const std::filesystem::path& path, const std::string& text);

}  // namespace marrow::write
