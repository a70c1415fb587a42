// SPDX-License-Identifier: Apache-2.0
#pragma once
// All readers open their files here.
#include <charconv>
#include <cstdint>
#include <filesystem>
#include <memory>
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

/// A stream of samples from a file, plain or decompressed on the way. So no more memory is needed than for the samples
/// that the header claims.
class ByteStream {
 public:
  virtual ~ByteStream() = default;
  /// Copies the next `count` bytes, or fewer at the end. Returns how many. Throws Error if the stream is damaged.
  virtual std::size_t take(void* to, std::size_t count) = 0;
  /// Number of bytes after the end of a compressed stream. Valid only after all of the stream was taken.
  virtual std::uint64_t bytes_behind() const { return 0; }
};

/// The decompressed bytes of a zlib or gzip stream between two offsets. Reading to the end verifies the checksum.
std::unique_ptr<ByteStream> unpacked_bytes(const InputFile& file, std::uint64_t begin, std::uint64_t end);
/// The same of a Deflate stream without a header or checksum.
std::unique_ptr<ByteStream> bare_unpacked_bytes(const InputFile& file, std::uint64_t begin, std::uint64_t end);
/// The decompressed bytes of a gzip file, or the bytes of any other file.
std::unique_ptr<ByteStream> bytes_of_gzip_or_plain(const InputFile& file);

/// Takes `count` bytes. Throws Error if there are fewer.
void take_all(ByteStream& stream, const InputFile& file, void* to, std::size_t count);
/// Throws Error if bytes are left: a header that claims too little is as wrong as one that claims too much.
void expect_end(ByteStream& stream, const InputFile& file);

/// The name of an item from that of its file, in which some characters are written as in web addresses: "a%2Fb" is a/b.
inline std::string unescaped_name(const std::string& file_name) {
  std::string name;
  for (std::size_t i = 0; i < file_name.size(); ++i) {
    unsigned byte = 0;
    const char* code = file_name.data() + i + 1;
    const bool is_code =
        file_name[i] == '%' && i + 2 < file_name.size() && std::from_chars(code, code + 2, byte, 16).ptr == code + 2;
    name += is_code ? char(byte) : file_name[i];
    if (is_code) i += 2;
  }
  return name;
}

}  // namespace marrow::files
