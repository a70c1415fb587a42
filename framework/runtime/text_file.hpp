// SPDX-License-Identifier: Apache-2.0
#pragma once
// Whole files of text: read with a limit, written so that a half one never stands under its name.
#include <cstdint>
#include <filesystem>
#include <string>

namespace marrow {

inline constexpr std::uintmax_t kMostSourceBytes = 4'000'000;    ///< of a file that people write
inline constexpr std::uintmax_t kMostRecordBytes = 256'000'000;  ///< of a file that marrow wrote

enum class Kinds { files, files_and_pipes };  ///< a pipe may keep its reader waiting for ever

/// Throws Error for a file that cannot be read, is longer than `most_bytes`, or is none of `kinds`.
std::string read_text_file(const std::filesystem::path& file, std::uintmax_t most_bytes, Kinds kinds = Kinds::files);

/// Writes a temporary file beside it and renames that, so that a full disk or an end by force leaves the file that was
/// there before, or none. A link is replaced, a device or pipe is written to. Throws Error.
void write_text_file(const std::filesystem::path& file, const std::string& text);

}  // namespace marrow
