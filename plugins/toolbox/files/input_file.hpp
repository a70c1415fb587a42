// SPDX-License-Identifier: Apache-2.0
#pragma once
// All readers open their files here.
#include <cstdint>
#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

#include "marrow/base/descriptor.hpp"

namespace marrow::files {

/// A regular file that is open for reading. If another program shortens the file meanwhile, read() throws Error; no
/// signal is raised, as it would be with a mapped file. Several threads may read at once.
class InputFile {
 public:
  /// Throws Error unless `path` is a regular file that can be read. It must not be empty unless `may_be_empty`. Pipes
  /// and devices are refused at once, without waiting for data.
  explicit InputFile(std::filesystem::path path, bool may_be_empty = false);

  const std::filesystem::path& path() const { return path_; }
  std::uint64_t size() const { return size_; }
  /// Copies exactly `count` bytes from offset `at`. Throws Error if the file does not hold them.
  void read(std::uint64_t at, void* to, std::size_t count) const;
  /// The same bytes as a string.
  std::string text(std::uint64_t at, std::size_t count) const;

 private:
  std::filesystem::path path_;
  Descriptor descriptor_;
  std::uint64_t size_ = 0;
};

/// All bytes of a file. Throws Error as InputFile does, or if there are more than `most` bytes.
std::string read_bytes(const std::filesystem::path& path, std::uint64_t most, bool may_be_empty = false);

/// All of a file that is a text, as UTF-8 in lines that end with \n, however its writer stored it (plain_text() in
/// domain/plain_text.hpp). Throws Error as read_bytes() does.
std::string read_text(const std::filesystem::path& path, std::uint64_t most, bool may_be_empty = false);

/// The unsigned number that these bytes hold, at most 8 of them.
std::uint64_t number_in_bytes(std::string_view bytes, bool big_endian);

/// Reads single numbers and texts at any offset of a file. It reads a larger part at once, so that neighbours need no
/// further access. For use in one thread. The file must outlive it.
class FileWindow {
 public:
  explicit FileWindow(const InputFile& file) : file_(&file), size_(file.size()) {}
  /// Reads `content` instead, which was unpacked from the file.
  FileWindow(const InputFile& file, const std::string& content)
      : file_(&file), size_(content.size()), part_(content.begin(), content.end()) {}
  /// The number of bytes that can be read.
  std::uint64_t size() const { return size_; }
  /// Whether there are `count` bytes at offset `at`.
  bool holds(std::uint64_t at, std::uint64_t count) const { return at <= size_ && count <= size_ - at; }
  /// The unsigned number of `width` bytes at an offset, and `count` bytes as a string. Both throw std::out_of_range if
  /// the bytes lie beyond the end of the file.
  std::uint64_t number(std::uint64_t at, int width, bool big_endian);
  std::string text(std::uint64_t at, std::size_t count);

 private:
  const char* bytes(std::uint64_t at, std::size_t count);
  const InputFile* file_;
  std::uint64_t size_;
  std::vector<char> part_;
  std::uint64_t begin_ = 0;
};

/// Throws Error if `file` is a link that leads out of `folder` or nowhere. Inputs that are folders are compared by the
/// content of the files in them, so a change of a file outside would not be noticed.
void check_stays_inside(const std::filesystem::path& folder, const std::filesystem::path& file);

}  // namespace marrow::files
