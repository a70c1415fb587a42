// SPDX-License-Identifier: Apache-2.0
#pragma once
// The one place where the readers open a file.
#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

namespace marrow::files {

/// A regular file that is open for reading. A part that is no longer there, as another program made the file shorter
/// meanwhile, is an Error, not a signal.
class InputFile {
 public:
  /// Throws Error unless `path` is a regular file, and one with something in it unless it `may_be_empty`. A pipe is not
  /// waited for, a device not read.
  explicit InputFile(std::filesystem::path path, bool may_be_empty = false);
  ~InputFile();
  InputFile(const InputFile&) = delete;
  InputFile& operator=(const InputFile&) = delete;

  const std::filesystem::path& path() const { return path_; }
  std::uint64_t size() const { return size_; }
  /// Exactly `count` bytes from the place `at`. Throws Error where they are not there.
  void read(std::uint64_t at, void* to, std::size_t count) const;
  /// The same as text.
  std::string text(std::uint64_t at, std::size_t count) const;

 private:
  std::filesystem::path path_;
  int descriptor_ = -1;
  std::uint64_t size_ = 0;
};

/// All bytes of a file. Throws Error, also where there are more than `most`.
std::string read_bytes(const std::filesystem::path& path, std::uint64_t most, bool may_be_empty = false);

/// Numbers and texts out of a file place by place, whose neighbours are read at once.
class FileWindow {
 public:
  explicit FileWindow(const InputFile& file) : file_(file) {}
  /// Whether `count` bytes lie in the file at this place.
  bool holds(std::uint64_t at, std::uint64_t count) const { return at <= file_.size() && count <= file_.size() - at; }
  /// The unsigned number of `width` bytes, or the bytes themselves. Throw std::out_of_range behind the file's end.
  std::uint64_t number(std::uint64_t at, int width, bool big_endian);
  std::string text(std::uint64_t at, std::size_t count);

 private:
  const char* bytes(std::uint64_t at, std::size_t count);
  const InputFile& file_;
  std::vector<char> part_;
  std::uint64_t begin_ = 0;
};

/// Throws Error where `file` is a link that leads out of `folder`, or nowhere: a folder counts by the content of what
/// lies in it, so what lies elsewhere would be missed when it changes.
void check_stays_inside(const std::filesystem::path& folder, const std::filesystem::path& file);

}  // namespace marrow::files
