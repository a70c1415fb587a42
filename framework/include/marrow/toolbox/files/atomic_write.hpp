// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <filesystem>
#include <functional>
#include <initializer_list>
#include <string>
#include <string_view>

namespace marrow::files {

/// Calls `fill` with a temporary name beside `path` that ends in the same extension, then renames what it made to
/// `path`. On any failure the temporary file or folder is removed, `path` is as it was before, and Error names it.
void write_atomically(const std::filesystem::path& path, const std::function<void(const std::filesystem::path&)>& fill);

/// Writes text in this way.
void write_text(const std::filesystem::path& path, const std::string& text);

/// Writes parts one after the other under this very name; throws Error when not all of it could be written.
void write_plainly(const std::filesystem::path& path, std::initializer_list<std::string_view> parts);

}  // namespace marrow::files
