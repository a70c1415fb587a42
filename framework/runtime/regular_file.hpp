// SPDX-License-Identifier: Apache-2.0
#pragma once
// Reading files that someone else may have put there, and writing them whole.
#include <sys/stat.h>

#include <cstdint>
#include <filesystem>
#include <string>

#include "marrow/runtime/hash.hpp"

namespace marrow {

/// A regular file that is open for reading. Nothing else is opened: the reader of a named pipe waits for ever, and a
/// device may act on being opened. Errors begin with a verb, to be put behind the file's name: "is a named pipe, not a
/// file".
class RegularFile {
 public:
  explicit RegularFile(const std::filesystem::path& file);
  ~RegularFile();
  RegularFile(const RegularFile&) = delete;
  RegularFile& operator=(const RegularFile&) = delete;

  /// As it was when it was opened.
  const struct stat& status() const { return status_; }
  std::uint64_t size() const { return std::uint64_t(status_.st_size); }
  /// How many bytes were read; fewer than wanted only at the end of the file.
  std::size_t read(void* to, std::size_t wanted, std::uint64_t offset) const;
  /// Throws Error when the file is no longer as it was when it was opened.
  void expect_unchanged() const;

 private:
  int descriptor_;
  struct stat status_ {};
};

/// Of the content. Throws Error, which begins with a verb, when it changes while it is read.
Digest digest_of(const RegularFile& file);

/// The whole content. Throws Error, which begins with a verb, for more than `most_bytes`.
std::string read_text(const RegularFile& file, std::size_t most_bytes);

/// Writes a file under a temporary name and renames it then, so that no reader and no second writer sees half of it.
/// What cannot be written leaves nothing behind and throws Error with the file's name and the reason.
void write_text(const std::filesystem::path& file, const std::string& text, mode_t mode);

}  // namespace marrow
