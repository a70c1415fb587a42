// SPDX-License-Identifier: Apache-2.0
#pragma once
// Files of the store. They are written whole or not at all. Readers never trust their size.
#include <sys/types.h>

#include <cstdint>
#include <filesystem>
#include <functional>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "marrow/base/descriptor.hpp"
#include "marrow/base/hash.hpp"

namespace MARROW_EXPORT_TO_TESTS marrow {

/// Permissions of new files and folders of a store, with any umask. If a group is named, no other group gets its
/// rights.
struct Permissions {
  mode_t file = 0600, folder = 0700;
  std::optional<gid_t> group = {};
};
/// Gives an open file or folder the permissions. Returns false, with errno, if that is not possible.
bool permit(int descriptor, mode_t mode, const Permissions& permissions);

/// Opens a new file for writing. Makes its folder if it is missing, even while other processes do the same. Returns -1
/// with errno on a fault: EEXIST if the file exists.
int open_new_file(const std::filesystem::path& file, const Permissions& permissions);

/// A regular file that is open for reading. Links are not followed.
class StoreFile {
 public:
  explicit StoreFile(const std::filesystem::path& path);

  bool is_open() const { return descriptor_.is_open(); }
  std::uint64_t size() const { return size_; }  ///< the size when it was opened
  int fault() const { return fault_; }          ///< errno, if it is not open
  /// Returns false if the file has become shorter or cannot be read.
  bool read(void* data, std::size_t size, std::uint64_t offset) const;
  void mark_as_used() const;
  /// The same, but at most once a day.
  void mark_as_used_today() const;

 private:
  int fault_ = 0;
  Descriptor descriptor_;
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
  std::size_t next_ = 0, end_ = 0;  ///< the unused part of the buffer
  Hasher hasher_;
};

/// Writes what `fill` adds to a temporary file with these permissions, and renames it. Makes the folder if it is
/// missing. Returns why this failed, or an empty text; after a failure, nothing is left behind. With `is_durable`,
/// waits until the file is on the disk.
std::string write_whole(const std::filesystem::path& file, const std::function<void(Archive&)>& fill,
                        bool is_durable = false, const Permissions& permissions = {});

/// Write and read a small file with its digest in front. A file that does not match its digest, or has more than
/// `most_bytes`, counts as absent.
std::string write_checked(const std::filesystem::path& file, std::string_view text);
std::optional<std::string> read_checked(const std::filesystem::path& file, std::uint64_t most_bytes);

}  // namespace marrow
