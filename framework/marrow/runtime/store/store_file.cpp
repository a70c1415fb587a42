// SPDX-License-Identifier: Apache-2.0
#include "marrow/runtime/store/store_file.hpp"

#include <fcntl.h>
#include <sys/stat.h>
#include <time.h>

#include <cerrno>
#include <cstdlib>
#include <new>

#include "marrow/base/text_file.hpp"
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
      write({static_cast<const char*>(data), size});
    else
      buffer_.append(static_cast<const char*>(data), size);
  }
  /// Returns 0, or the errno of the first fault.
  int flush() {
    write(buffer_);
    buffer_.clear();
    return fault_;
  }

 private:
  void write(std::string_view part) {
    if (!fault_ && !write_all(descriptor_, part)) fault_ = errno;
  }

  int descriptor_;
  int fault_ = 0;
  std::string buffer_;
};

constexpr int kMostOpenings = 5;  // to open a file whose handle has become stale

}  // namespace

bool permit(int descriptor, mode_t mode, const Permissions& permissions) {
  constexpr mode_t kOfGroup = S_IRWXG | S_ISGID;
  struct stat status {};
  if (fstat(descriptor, &status) != 0) return false;
  if (permissions.group && status.st_gid != *permissions.group &&
      fchown(descriptor, uid_t(-1), *permissions.group) != 0)
    mode &= ~kOfGroup;  // the file stays with another group, which must not read it
  return fchmod(descriptor, mode) == 0;
}

int open_new_file(const fs::path& file, const Permissions& permissions) {
  constexpr int kMode = O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC | O_NOFOLLOW;
  constexpr int kMostTries = 20;
  const fs::path folder = file.parent_path();
  int descriptor = open(file.c_str(), kMode, 0600);
  // Another process that makes the same folder may replace the new folder by its own empty one.
  for (int tries = 0; descriptor < 0 && errno == ENOENT && tries < kMostTries; ++tries) {
    if (!(permissions.group ? make_shared_folder(folder, permissions) : make_private_folder(folder)).empty()) break;
    descriptor = open(file.c_str(), kMode, 0600);
  }
  if (descriptor >= 0) permit(descriptor, permissions.file, permissions);
  return descriptor;
}

StoreFile::StoreFile(const fs::path& path) {
  // In a shared folder, a name may lead to a file that another host has just replaced. The next try finds the new one.
  for (int tries = 0; !is_open() && tries < kMostOpenings && (tries == 0 || errno == ESTALE); ++tries)
    descriptor_ = Descriptor(open(path.c_str(), O_RDONLY | O_CLOEXEC | O_NOFOLLOW | O_NONBLOCK | O_NOCTTY));
  if (!is_open()) fault_ = errno;
  struct stat status {};
  if (is_open() && fstat(descriptor_, &status) == 0 && S_ISREG(status.st_mode)) {
    size_ = std::uint64_t(status.st_size);
  } else if (is_open()) {
    descriptor_.close();
    fault_ = ENOENT;
  }
}

bool StoreFile::read(void* data, std::size_t size, std::uint64_t offset) const {
  return read_at(descriptor_, data, size, offset) == std::int64_t(size);
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
  const auto fault_of = [&](int number) { return "cannot write " + file.string() + ": " + std::strerror(number); };
  AtomicFile whole(file, temporary_beside, [&](const fs::path& name) { return open_new_file(name, permissions); });
  if (!whole.descriptor().is_open()) return fault_of(errno);
  try {
    FileWriter writer(whole.descriptor());
    fill(writer);
    if (const int number = writer.flush()) return fault_of(number);
  } catch (const std::bad_alloc&) {
    return fault_of(ENOMEM);
  } catch (...) {  // a value of a plugin's own type
    return reason_of_exception();
  }
  return whole.finish(is_durable) ? "" : fault_of(errno);
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
