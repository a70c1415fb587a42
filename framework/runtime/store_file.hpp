// SPDX-License-Identifier: Apache-2.0
#pragma once
// Files of the store. They are written whole or not at all. Readers never trust their size.
#include <cstdint>
#include <filesystem>
#include <functional>
#include <string>
#include <vector>

#include "marrow/runtime/hash.hpp"

namespace marrow {

/// A regular file that is open for reading. A link is not opened.
class StoreFile {
 public:
  explicit StoreFile(const std::filesystem::path& path);
  ~StoreFile();
  StoreFile(const StoreFile&) = delete;
  StoreFile& operator=(const StoreFile&) = delete;

  bool is_open() const { return descriptor_ >= 0; }
  std::uint64_t size() const { return size_; }  ///< the size when it was opened
  /// Returns false if the file has become shorter or cannot be read.
  bool read(void* data, std::size_t size, std::uint64_t offset) const;
  void mark_as_used() const;

 private:
  int descriptor_ = -1;
  std::uint64_t size_ = 0;
};

/// Unpacks a part of a file and hashes it at the same time. The file is not mapped into memory: if a mapped file is
/// truncated, reading it ends the process.
class FileUnpacker : public Unpacker {
 public:
  FileUnpacker(const StoreFile& file, std::uint64_t offset, std::uint64_t size);
  /// Digest of everything that was read so far. If nothing remains, it is the digest of the whole part.
  Digest digest() const { return hasher_.digest(); }

 protected:
  void take(void* data, std::size_t size) override;

 private:
  void read(char* data, std::size_t size);

  const StoreFile& file_;
  std::uint64_t offset_, unread_;
  std::vector<char> buffer_;
  std::size_t next_ = 0, end_ = 0;  ///< the part of the buffer that was not taken yet
  Hasher hasher_;
};

/// Writes what `fill` adds to a temporary file that only its owner can read, and renames it. Makes the folder if it is
/// missing. Returns why this failed, or an empty text; after a failure, nothing is left behind. With `is_durable`,
/// waits until the file is on the disk.
std::string write_whole(const std::filesystem::path& file, const std::function<void(Archive&)>& fill,
                        bool is_durable = false);

}  // namespace marrow
