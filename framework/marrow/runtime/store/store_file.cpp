// SPDX-License-Identifier: Apache-2.0
#include "marrow/runtime/store/store_file.hpp"

#include <fcntl.h>
#include <sys/stat.h>
#include <time.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstdlib>
#include <cstring>
#include <new>

#include "marrow/base/reason_of_exception.hpp"
#include "marrow/runtime/store/store_folder.hpp"

namespace marrow {
namespace {

namespace fs = std::filesystem;

constexpr std::size_t kBuffer = 64 * 1024;
constexpr std::size_t kPiece = 256 * 1024;  // read and hashed while it is in the processor's cache

/// Writes to a file. Small pieces are gathered and written together. Remembers the first fault.
class FileWriter : public Archive {
 public:
  explicit FileWriter(int descriptor) : descriptor_(descriptor) {}
  void bytes(const void* data, std::size_t size) override {
    if (buffer_.size() + size > kBuffer) flush();
    if (size > kBuffer)
      write_all(static_cast<const char*>(data), size);
    else
      buffer_.append(static_cast<const char*>(data), size);
  }
  /// Returns 0, or the errno of the first fault.
  int flush() {
    write_all(buffer_.data(), buffer_.size());
    buffer_.clear();
    return fault_;
  }

 private:
  void write_all(const char* data, std::size_t size) {
    while (size > 0 && !fault_) {
      const ssize_t count = write(descriptor_, data, size);
      if (count == 0 || (count < 0 && errno != EINTR)) fault_ = count ? errno : EIO;
      if (count > 0) {
        data += count;
        size -= std::size_t(count);
      }
    }
  }

  int descriptor_;
  int fault_ = 0;
  std::string buffer_;
};

/// Makes a new file next to `file` and puts its name into `temporary`. Returns -1 with errno if it cannot be made.
int open_temporary(const fs::path& file, const Permissions& permissions, fs::path& temporary) {
  int descriptor = -1;
  do {
    temporary = temporary_beside(file);
    descriptor = open_new_file(temporary, permissions);
  } while (descriptor < 0 && (errno == EEXIST || errno == EINTR));
  return descriptor;
}

constexpr int kMostOpenings = 5;  // to open a file whose handle has become stale

}  // namespace

bool permit(int descriptor, mode_t mode, const Permissions& permissions) {
  constexpr mode_t kOfGroup = S_IRWXG | S_ISGID;
  struct stat status {};
  if (fstat(descriptor, &status) != 0) return false;
  if (permissions.group && status.st_gid != *permissions.group &&
      fchown(descriptor, uid_t(-1), *permissions.group) != 0)
    mode &= ~kOfGroup;  // it has another group, which must not read it
  return fchmod(descriptor, mode) == 0;
}

int open_new_file(const fs::path& file, const Permissions& permissions) {
  constexpr int kMode = O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC | O_NOFOLLOW;
  constexpr int kMostTries = 20;
  const fs::path folder = file.parent_path();
  int descriptor = open(file.c_str(), kMode, 0600);
  // Another process that makes the same folder may put its own, empty one in the place of the one that was just made.
  for (int tries = 0; descriptor < 0 && errno == ENOENT && tries < kMostTries; ++tries) {
    if (!(permissions.group ? make_shared_folder(folder, permissions) : make_private_folder(folder)).empty()) break;
    descriptor = open(file.c_str(), kMode, 0600);
  }
  if (descriptor >= 0) permit(descriptor, permissions.file, permissions);
  return descriptor;
}

StoreFile::StoreFile(const fs::path& path) {
  // On a shared folder a name may lead to a file that another host has just replaced. The next try finds the new one.
  for (int tries = 0; descriptor_ < 0 && tries < kMostOpenings && (tries == 0 || errno == ESTALE); ++tries)
    descriptor_ = open(path.c_str(), O_RDONLY | O_CLOEXEC | O_NOFOLLOW | O_NONBLOCK | O_NOCTTY);
  if (descriptor_ < 0) fault_ = errno;
  struct stat status {};
  if (descriptor_ >= 0 && fstat(descriptor_, &status) == 0 && S_ISREG(status.st_mode)) {
    size_ = std::uint64_t(status.st_size);
  } else if (descriptor_ >= 0) {
    close(descriptor_);
    descriptor_ = -1;
    fault_ = ENOENT;
  }
}

StoreFile::~StoreFile() {
  if (descriptor_ >= 0) close(descriptor_);
}

bool StoreFile::read(void* data, std::size_t size, std::uint64_t offset) const {
  for (std::size_t done = 0; done < size;) {
    const ssize_t count = pread(descriptor_, static_cast<char*>(data) + done, size - done, off_t(offset + done));
    if (count == 0 || (count < 0 && errno != EINTR)) return false;
    if (count > 0) done += std::size_t(count);
  }
  return true;
}

void StoreFile::mark_as_used() const { futimens(descriptor_, nullptr); }

void StoreFile::mark_as_used_today() const {
  constexpr time_t kDay_s = 24 * 3600;
  struct stat status {};
  if (fstat(descriptor_, &status) == 0 && std::abs(time(nullptr) - status.st_mtime) >= kDay_s) mark_as_used();
}

FileUnpacker::FileUnpacker(const StoreFile& file, std::uint64_t offset, std::uint64_t size)
    : Unpacker(std::size_t(size)),
      file_(file),
      offset_(offset),
      unread_(size),
      buffer_(std::size_t(std::min<std::uint64_t>(size, kBuffer))) {}

void FileUnpacker::read(char* data, std::size_t size) {
  if (!file_.read(data, size, offset_)) throw Error("the file cannot be read, or has become shorter");
  hasher_.bytes(data, size);
  offset_ += size;
  unread_ -= size;
}

void FileUnpacker::take(void* data, std::size_t size) {
  char* to = static_cast<char*>(data);
  while (size > 0) {
    std::size_t count = 0;
    if (next_ == end_ && size >= buffer_.size()) {
      count = std::min(size, kPiece);
      read(to, count);
    } else {
      if (next_ == end_) {
        next_ = 0;
        end_ = std::size_t(std::min<std::uint64_t>(unread_, buffer_.size()));
        read(buffer_.data(), end_);
      }
      count = std::min(size, end_ - next_);
      std::memcpy(to, buffer_.data() + next_, count);
      next_ += count;
    }
    to += count;
    size -= count;
  }
}

std::string write_whole(const fs::path& file, const std::function<void(Archive&)>& fill, bool is_durable,
                        const Permissions& permissions) {
  fs::path temporary;
  const auto fault_of = [&](int number) { return "cannot write " + file.string() + ": " + std::strerror(number); };
  const int descriptor = open_temporary(file, permissions, temporary);
  if (descriptor < 0) return fault_of(errno);
  std::string fault;
  try {
    FileWriter writer(descriptor);
    fill(writer);
    if (const int number = writer.flush()) fault = fault_of(number);
  } catch (const std::bad_alloc&) {
    fault = fault_of(ENOMEM);
  } catch (...) {  // a value of a plugin's own type
    fault = reason_of_exception();
  }
  if (fault.empty() && is_durable && fsync(descriptor)) fault = fault_of(errno);
  // Some file systems report only now that there is no space. After EINTR, the file is closed nevertheless.
  if (close(descriptor) && errno != EINTR && fault.empty()) fault = fault_of(errno);
  if (fault.empty() && std::rename(temporary.c_str(), file.c_str())) fault = fault_of(errno);
  if (!fault.empty()) unlink(temporary.c_str());
  return fault;
}

std::string write_checked(const fs::path& file, std::string_view text) {
  const Digest check = hash_of_bytes(text.data(), text.size());
  return write_whole(file, [&](Archive& out) {
    out.bytes(&check, sizeof check);
    out.bytes(text.data(), text.size());
  });
}

std::optional<std::string> read_checked(const fs::path& path, std::uint64_t most_bytes) {
  const StoreFile file(path);
  Digest check;
  if (!file.is_open() || file.size() <= sizeof check || file.size() > most_bytes) return std::nullopt;
  std::string text(std::size_t(file.size()) - sizeof check, '\0');
  if (!file.read(&check, sizeof check, 0) || !file.read(text.data(), text.size(), sizeof check)) return std::nullopt;
  return hash_of_bytes(text.data(), text.size()) == check ? std::optional(std::move(text)) : std::nullopt;
}

}  // namespace marrow
