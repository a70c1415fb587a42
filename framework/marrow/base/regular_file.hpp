// SPDX-License-Identifier: Apache-2.0
#pragma once
// Reads files that someone else may have put there.
#include <sys/stat.h>

#include <sys/types.h>
#include <time.h>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>

#include "marrow/base/descriptor.hpp"
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

/// What distinguishes two states of a file. A write changes the time of the file's last change, which no program can
/// set. If the file is mapped into memory, only the first write after write_back() changes it.
struct FileState {
  dev_t device = 0;
  ino_t number = 0;
  off_t size = 0;
  timespec written{}, changed{};
  bool operator==(const FileState& other) const;
  void add_to(Hasher& hasher) const;
};

/// Nothing if the file is not there.
std::optional<FileState> state_of(const std::filesystem::path& file);

/// Whether every later change of the file will show in its state. Ask before reading the file. A file that was changed
/// just now may change again within the resolution of its time, which is at most 2 s. The clock of a network file
/// system may differ from this host's by minutes. There the file must have been in this state for 10 minutes, or for
/// 2 s since this process first asked. A file that exists only in memory may change without a new time.
bool is_settled(const std::filesystem::path& file, const FileState& state);

/// Throws Error, with a text that begins with a verb, if the file is not a whole ELF library for this machine. With
/// such a file, the dynamic loader would fail with an unclear message or crash.
void check_elf(const RegularFile& file);

/// The build id that the linker writes into each ELF file as a note; empty if there is none or the file is damaged.
std::string build_note(const RegularFile& file);

}  // namespace marrow
