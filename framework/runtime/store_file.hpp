// SPDX-License-Identifier: Apache-2.0
#pragma once
// Files of the store: written whole or not at all, read without ever trusting their size.
#include <cstdint>
#include <filesystem>
#include <functional>
#include <string>
#include <vector>

#include "marrow/runtime/hash.hpp"

namespace marrow {

/// A regular file, open for reading; not one that is reached by a link.
class StoreFile {
 public:
  explicit StoreFile(const std::filesystem::path& path);
  ~StoreFile();
  StoreFile(const StoreFile&) = delete;
  StoreFile& operator=(const StoreFile&) = delete;

  bool is_open() const { return descriptor_ >= 0; }
  std::uint64_t size() const { return size_; }  ///< when it was opened
  /// False where the file has become shorter or cannot be read.
  bool read(void* data, std::size_t size, std::uint64_t offset) const;
  void mark_as_used() const;

 private:
  int descriptor_ = -1;
  std::uint64_t size_ = 0;
};

/// Reads a part of a file and hashes it on the way. Not by a map of the file: one that is truncated meanwhile would end
/// the process.
class FileUnpacker : public Unpacker {
 public:
  FileUnpacker(const StoreFile& file, std::uint64_t offset, std::uint64_t size);
  /// Of all that was read so far; of the whole part when nothing remains.
  Digest digest() const { return hasher_.digest(); }

 protected:
  void take(void* data, std::size_t size) override;

 private:
  void read(char* data, std::size_t size);

  const StoreFile& file_;
  std::uint64_t offset_, unread_;
  std::vector<char> buffer_;
  std::size_t next_ = 0, end_ = 0;  ///< of what the buffer holds
  Hasher hasher_;
};

/// Writes what `fill` gives to a temporary file, for its owner's eyes only, and renames it; its folder is made where
/// that is missing. Returns why that failed, and leaves nothing then. `is_durable`: waits until it is on the disk.
std::string write_whole(const std::filesystem::path& file, const std::function<void(Archive&)>& fill,
                        bool is_durable = false);

}  // namespace marrow
