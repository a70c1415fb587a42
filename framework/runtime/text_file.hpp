// SPDX-License-Identifier: Apache-2.0
#pragma once
// Whole files of text: read with a limit, written so that a half one never stands under its name.
#include <cstdint>
#include <filesystem>
#include <string>

namespace marrow {

inline constexpr std::uintmax_t kMostSourceBytes = 4'000'000;    ///< of a file that people write
inline constexpr std::uintmax_t kMostRecordBytes = 256'000'000;  ///< of a file that marrow wrote

/// Throws Error for a file that cannot be read, or is longer than `most_bytes`, and for what is no regular file: a pipe
/// may keep its reader waiting for ever, and a device may act on being opened.
std::string read_text_file(const std::filesystem::path& file, std::uintmax_t most_bytes);

enum class Kinds { files, files_and_pipes };

/// Writes a temporary file beside it and renames that, so that a full disk or an end by force leaves the file that was
/// there before, or none. A link is replaced; so is a pipe or device, unless `kinds` has them: who names one, or a link
/// to one, as the place of a result means it, but one among marrow's own files would only keep its writer waiting.
/// Throws Error.
void write_text_file(const std::filesystem::path& file, const std::string& text, Kinds kinds = Kinds::files);

}  // namespace marrow
