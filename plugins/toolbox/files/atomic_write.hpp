// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <filesystem>
#include <functional>
#include <initializer_list>
#include <string>
#include <string_view>

namespace marrow::files {

/// Calls `fill` with a temporary path beside `path`. Then renames the file or folder that `fill` made to `path`. On any
/// failure the temporary file or folder is removed, `path` is as before, and an Error that names it is thrown.
void write_atomically(const std::filesystem::path& path, const std::function<void(const std::filesystem::path&)>& fill);

/// Writes text atomically, as above.
void write_text(const std::filesystem::path& path, const std::string& text);

/// Writes the parts one after the other directly to `path`, not atomically. Throws Error if not all could be written.
void write_plainly(const std::filesystem::path& path, std::initializer_list<std::string_view> parts);

}  // namespace marrow::files
