// SPDX-License-Identifier: Apache-2.0
#pragma once
// Reads files that someone else may have put there.
#include <sys/stat.h>

#include <cstdint>
#include <filesystem>
#include <string>

#include "marrow/base/descriptor.hpp"
#include "marrow/base/export.hpp"
#include "marrow/base/hash.hpp"

namespace MARROW_EXPORT_TO_TESTS marrow {

/// A regular file that is open for reading. Anything else is refused: the reader of a named pipe may wait for ever, and
/// opening a device may have an effect. The text of an Error begins with a verb, so that it can follow the file's name:
/// "is a named pipe, not a regular file".
class RegularFile {
 public:
  explicit RegularFile(const std::filesystem::path& file);

  /// The status at the time when the file was opened.
  const struct stat& status() const { return status_; }
  std::uint64_t size() const { return std::uint64_t(status_.st_size); }
  /// Returns how many bytes were read. They are fewer than wanted only at the end of the file.
  std::size_t read(void* to, std::size_t wanted, std::uint64_t offset) const;
  /// Throws Error if the size of the file or its time of writing is different from when it was opened.
  void expect_unchanged() const;

 private:
  Descriptor descriptor_;
  struct stat status_ {};
};

/// Digest of the content. Throws Error, with a text that begins with a verb, if the file changes while it is read.
Digest digest_of(const RegularFile& file);

/// Digest of the content of a regular file. Throws Error for anything else, and if the file changes while it is read.
Digest file_digest(const std::filesystem::path& file);

/// The whole content. Throws Error, with a text that begins with a verb, if the file has more than `most_bytes` or
/// changes while it is read.
std::string read_text(const RegularFile& file, std::size_t most_bytes);

}  // namespace marrow
