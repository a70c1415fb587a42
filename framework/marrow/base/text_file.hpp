// SPDX-License-Identifier: Apache-2.0
#pragma once
// Reads whole text files with a limit of their size. Writes them so that a file is never half written.
#include <sys/types.h>

#include <cstdint>
#include <filesystem>
#include <string>

#include "marrow/base/export.hpp"

namespace MARROW_EXPORT marrow {

inline constexpr std::uintmax_t kMostSourceBytes = 4'000'000;    ///< limit for a file that people write
inline constexpr std::uintmax_t kMostRecordBytes = 256'000'000;  ///< limit for a file that marrow wrote

/// Throws Error if the file cannot be read, is longer than `most_bytes` or is not a regular file. The reader of a pipe
/// may wait for ever, and opening a device may have an effect.
std::string read_text_file(const std::filesystem::path& file, std::uintmax_t most_bytes);

/// A file that a command was given. "-" is the standard input, which is read once; as a file, "-" is given as ./-.
/// Throws Error as read_text_file() does.
std::string read_given_text(const std::filesystem::path& file, std::uintmax_t most_bytes);

enum class Kinds { files, files_and_pipes };

/// Writes a temporary file next to `file` and renames it. If the disk is full or the process is killed, the old file
/// stays, or there is none. A link is replaced. A pipe or device is replaced too, unless `kinds` includes pipes. A user
/// who names a pipe, or a link to one, as the place of a result wants it to be used. But a pipe among marrow's own
/// files would only make the writer wait. `mode` is that of open(). Throws Error if the file cannot be written.
void write_text_file(const std::filesystem::path& file, const std::string& text, Kinds kinds = Kinds::files,
                     mode_t mode = 0666);

}  // namespace marrow
