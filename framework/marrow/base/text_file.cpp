// SPDX-License-Identifier: Apache-2.0
#include "marrow/base/text_file.hpp"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <atomic>
#include <cerrno>
#include <cstring>
#include <utility>

#include "marrow/base/error.hpp"
#include "marrow/base/regular_file.hpp"

namespace marrow {
namespace {

namespace fs = std::filesystem;

/// An open file, closed at the end of its scope.
class OpenFile {
 public:
  explicit OpenFile(int number) : number_(number) {}
  OpenFile(const fs::path& file, int flags) : number_(::open(file.c_str(), flags | O_CLOEXEC, 0666)) {}
  ~OpenFile() {
    if (number_ >= 0) ::close(number_);
  }
  OpenFile(const OpenFile&) = delete;
  OpenFile& operator=(const OpenFile&) = delete;
  operator int() const { return number_; }
  /// Returns false if the file cannot be closed: some file systems report only now that there is no space.
  bool close() { return ::close(std::exchange(number_, -1)) == 0; }

 private:
  int number_;
};

std::string reason() { return errno == ENOSPC || errno == EDQUOT ? "the disk is full" : std::strerror(errno); }

/// Opens a new file next to `file` for writing. Returns -1 with errno if this is not possible.
int open_part(const fs::path& file, fs::path& temporary) {
  static std::atomic<int> count{0};
  int number = -1;
  // A name may be taken: a killed process left it, or a process in another container or machine has the same number.
  do {
    temporary = file.parent_path() / (".part" + std::to_string(::getpid()) + "-" + std::to_string(++count));
    number = ::open(temporary.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, 0666);
  } while (number < 0 && errno == EEXIST);
  return number;
}

}  // namespace

std::string read_text_file(const fs::path& file, std::uintmax_t most_bytes) {
  const auto unreadable = [&](const std::string& why) { return Error(file.string() + " cannot be read: " + why); };
  const auto too_long = [&] {
    return Error(file.string() + " is longer than " + std::to_string(most_bytes / 1'000'000) + " MB");
  };
  struct stat info {};
  const auto check_kind = [&] {
    if (S_ISDIR(info.st_mode)) throw unreadable("it is a folder");
    if (!S_ISREG(info.st_mode)) throw unreadable("it is no regular file");
  };
  // The kind is also checked before the file is opened, because opening a device may have an effect.
  if (::stat(file.c_str(), &info) != 0) throw unreadable(reason());
  check_kind();
  OpenFile descriptor(file, O_RDONLY | O_NONBLOCK | O_NOCTTY);
  if (descriptor < 0 || ::fstat(descriptor, &info) != 0) throw unreadable(reason());
  check_kind();
  if (std::uintmax_t(info.st_size) > most_bytes) throw too_long();
  std::string text;
  for (std::string block(1 << 16, '\0');;) {
    const ssize_t count = ::read(descriptor, block.data(), block.size());
    if (count < 0 && errno == EINTR) continue;
    if (count < 0) throw unreadable(reason());
    if (count == 0) return text;
    text.append(block, 0, std::size_t(count));
    if (text.size() > most_bytes) throw too_long();
  }
}

void write_text_file(const fs::path& file, const std::string& text, Kinds kinds) {
  const auto unwritten = [&](const std::string& why) { return Error("cannot write " + file.string() + ": " + why); };
  struct stat info {};
  // stat() follows links, because /dev/stdout is a link.
  if (kinds == Kinds::files_and_pipes && ::stat(file.c_str(), &info) == 0 && !S_ISREG(info.st_mode) &&
      !S_ISDIR(info.st_mode)) {
    OpenFile device(file, O_WRONLY);
    if (device < 0 || !write_all(device, text) || !device.close()) throw unwritten(reason());
    return;
  }
  fs::path temporary;
  OpenFile descriptor(open_part(file, temporary));
  if (descriptor < 0) throw unwritten(reason());
  if (write_all(descriptor, text) && descriptor.close() && ::rename(temporary.c_str(), file.c_str()) == 0) return;
  const std::string why = reason();
  ::unlink(temporary.c_str());
  throw unwritten(why);
}

}  // namespace marrow
