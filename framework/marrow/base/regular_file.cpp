// SPDX-License-Identifier: Apache-2.0
#include "marrow/base/regular_file.hpp"

#include <fcntl.h>

#include <cerrno>
#include <cstring>
#include <memory>

#include "marrow/base/error.hpp"
#include "marrow/base/number_text.hpp"

namespace marrow {
namespace {

namespace fs = std::filesystem;

/// Small enough to stay in the cache of a core between reading and hashing.
constexpr std::size_t kBlock_bytes = 256 << 10;

void expect_regular(const struct stat& status) {
  const char* kind = "neither a file nor a folder";
  if (S_ISREG(status.st_mode)) return;
  if (S_ISDIR(status.st_mode)) kind = "a folder";
  if (S_ISFIFO(status.st_mode)) kind = "a named pipe";
  if (S_ISSOCK(status.st_mode)) kind = "a socket";
  if (S_ISCHR(status.st_mode) || S_ISBLK(status.st_mode)) kind = "a device";
  throw Error(std::string("is ") + kind + ", not a regular file");
}

Error unreadable() { return Error(std::string("cannot be read: ") + std::strerror(errno)); }

Error changed() { return Error("was changed while it was read; try again when nothing writes to it"); }

bool same(const timespec& a, const timespec& b) { return a.tv_sec == b.tv_sec && a.tv_nsec == b.tv_nsec; }

}  // namespace

RegularFile::RegularFile(const fs::path& file) {
  // The kind of the file is checked before it is opened, because opening a device may have an effect. It is checked
  // again afterwards, because the file may have been replaced in between.
  if (stat(file.c_str(), &status_) != 0) throw unreadable();
  expect_regular(status_);
  descriptor_ = Descriptor(open(file.c_str(), O_RDONLY | O_CLOEXEC | O_NONBLOCK | O_NOCTTY));
  if (!descriptor_.is_open() || fstat(descriptor_, &status_) != 0) throw unreadable();
  expect_regular(status_);
}

std::size_t RegularFile::read(void* to, std::size_t wanted, std::uint64_t offset) const {
  const std::int64_t got = read_at(descriptor_, to, wanted, offset);
  if (got < 0) throw unreadable();
  return std::size_t(got);
}

void RegularFile::expect_unchanged() const {
  struct stat now {};
  if (fstat(descriptor_, &now) != 0) throw unreadable();
  if (now.st_size != status_.st_size || !same(now.st_mtim, status_.st_mtim)) throw changed();
}

// The file is not mapped into memory. If another program makes a mapped file shorter, reading it ends the process.
Digest digest_of(const RegularFile& file) {
  const auto block = std::make_unique_for_overwrite<char[]>(kBlock_bytes);
  Hasher hasher;
  std::uint64_t at = 0;
  while (const std::size_t count = file.read(block.get(), kBlock_bytes, at)) {
    hasher.bytes(block.get(), count);
    at += count;
    if (at > file.size()) break;  // the file grows, perhaps for ever
  }
  if (at != file.size()) throw changed();
  file.expect_unchanged();
  return hasher.digest();
}

Digest file_digest(const fs::path& file) try { return digest_of(RegularFile(file)); } catch (const Error& error) {
  throw Error(file.string() + " " + error.what());
}

std::string read_text(const RegularFile& file, std::size_t most_bytes) {
  if (file.size() > most_bytes)
    throw Error(formatted("has {} bytes, more than the {} that it may have", file.size(), most_bytes));
  std::string text(std::size_t(file.size()), '\0');
  if (file.read(text.data(), text.size(), 0) != text.size()) throw changed();
  file.expect_unchanged();
  return text;
}

}  // namespace marrow
