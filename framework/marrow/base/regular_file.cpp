// SPDX-License-Identifier: Apache-2.0
#include "marrow/base/regular_file.hpp"

#include <fcntl.h>
#include <unistd.h>

#include <atomic>
#include <cerrno>
#include <cstring>
#include <memory>

#include "marrow/base/error.hpp"

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

/// Makes a new file next to the one that it will replace. Returns -1 with errno if it cannot be made.
int make_temporary(const fs::path& file, mode_t mode, fs::path& temporary) {
  static std::atomic<unsigned> count{0};
  int descriptor = -1;
  // A killed process with the same number may have left a file of that name.
  for (int attempt = 0; attempt < 100 && descriptor < 0; ++attempt) {
    temporary = file.string() + "." + std::to_string(getpid()) + "-" + std::to_string(count++) + ".tmp";
    descriptor = open(temporary.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, mode);
    if (descriptor < 0 && errno != EEXIST) break;
  }
  return descriptor;
}

}  // namespace

bool write_all(int descriptor, const std::string& text) {
  for (std::size_t at = 0; at < text.size();) {
    const ssize_t count = write(descriptor, text.data() + at, text.size() - at);
    if (count < 0 && errno == EINTR) continue;
    if (count <= 0) return false;
    at += std::size_t(count);
  }
  return true;
}

RegularFile::RegularFile(const fs::path& file) {
  // The kind of the file is checked before it is opened, because opening a device may have an effect. It is checked
  // again afterwards, because the file may have been replaced in between.
  if (stat(file.c_str(), &status_) != 0) throw unreadable();
  expect_regular(status_);
  descriptor_ = open(file.c_str(), O_RDONLY | O_CLOEXEC | O_NONBLOCK | O_NOCTTY);
  if (descriptor_ < 0) throw unreadable();
  try {
    if (fstat(descriptor_, &status_) != 0) throw unreadable();
    expect_regular(status_);
  } catch (...) {
    close(descriptor_);
    throw;
  }
}

RegularFile::~RegularFile() { close(descriptor_); }

std::size_t RegularFile::read(void* to, std::size_t wanted, std::uint64_t offset) const {
  std::size_t got = 0;
  while (got < wanted) {
    const ssize_t count = pread(descriptor_, static_cast<char*>(to) + got, wanted - got, off_t(offset + got));
    if (count < 0 && errno == EINTR) continue;
    if (count < 0) throw unreadable();
    if (count == 0) break;
    got += std::size_t(count);
  }
  return got;
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
    throw Error("has " + std::to_string(file.size()) + " bytes, more than the " + std::to_string(most_bytes) +
                " that it may have");
  std::string text(std::size_t(file.size()), '\0');
  if (file.read(text.data(), text.size(), 0) != text.size()) throw changed();
  file.expect_unchanged();
  return text;
}

void write_text(const fs::path& file, const std::string& text, mode_t mode) {
  fs::path temporary;
  const int descriptor = make_temporary(file, mode, temporary);
  if (descriptor < 0) throw Error("cannot write " + file.string() + ": " + std::strerror(errno));
  int reason = write_all(descriptor, text) ? 0 : errno;
  if (close(descriptor) != 0 && !reason) reason = errno;
  if (!reason && rename(temporary.c_str(), file.c_str()) != 0) reason = errno;
  if (!reason) return;
  unlink(temporary.c_str());
  throw Error("cannot write " + file.string() + ": " + std::strerror(reason));
}

}  // namespace marrow
