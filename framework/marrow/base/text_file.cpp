// SPDX-License-Identifier: Apache-2.0
#include "marrow/base/text_file.hpp"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <atomic>
#include <cerrno>
#include <cstdio>
#include <cstring>

#include "marrow/base/number_text.hpp"
#include "marrow/base/process_tree.hpp"
#include "marrow/base/regular_file.hpp"

namespace marrow {
namespace {

namespace fs = std::filesystem;

Error too_long(const fs::path& file, std::uintmax_t most_bytes) {
  return Error(formatted("{} is longer than {} MB", file.string(), most_bytes / 1'000'000));
}

/// What stands there, up to what the longest file may have.
struct StandardInput {
  std::string text, fault;

  StandardInput() {
    std::string block(1 << 16, '\0');
    while (text.size() <= kMostSourceBytes) {
      const ssize_t count = ::read(STDIN_FILENO, block.data(), block.size());
      if (count == 0) return;
      if (count > 0)
        text.append(block, 0, std::size_t(count));
      else if (errno != EINTR) {
        fault = std::strerror(errno);
        return;
      }
    }
  }
};

std::string reason() { return errno == ENOSPC || errno == EDQUOT ? "the disk is full" : std::strerror(errno); }

constexpr const char* kMark = ".tmp-";

std::string mark_of_temporary() {
  static std::atomic<std::uint64_t> number{0};
  return formatted("{}{}-{}", kMark, this_process(), number++);
}

}  // namespace

std::string read_text_file(const fs::path& file, std::uintmax_t most_bytes) {
  try {
    const RegularFile opened(file);
    std::string text;
    for (std::string block(1 << 16, '\0'); opened.size() <= most_bytes && text.size() <= most_bytes;) {
      const std::size_t count = opened.read(block.data(), block.size(), text.size());
      if (count == 0) return text;
      text.append(block, 0, count);
    }
  } catch (const Error& error) {
    throw Error(file.string() + " " + error.what());
  }
  throw too_long(file, most_bytes);
}

std::string read_given_text(const fs::path& file, std::uintmax_t most_bytes) {
  if (file != "-") return read_text_file(file, most_bytes);
  static const StandardInput input;
  if (!input.fault.empty()) throw Error("- (the standard input) cannot be read: " + input.fault);
  if (input.text.size() > most_bytes) throw too_long(file, most_bytes);
  return input.text;
}

void write_text_file(const fs::path& file, const std::string& text, Kinds kinds, mode_t mode) {
  const auto unwritten = [&](const std::string& why) { return Error("cannot write " + file.string() + ": " + why); };
  struct stat info {};
  // stat() follows links, because /dev/stdout is a link.
  if (kinds == Kinds::files_and_pipes && ::stat(file.c_str(), &info) == 0 && !S_ISREG(info.st_mode) &&
      !S_ISDIR(info.st_mode)) {
    Descriptor device(::open(file.c_str(), O_WRONLY | O_CLOEXEC));
    if (device < 0 || !write_all(device, text) || !device.close()) throw unwritten(reason());
    return;
  }
  AtomicFile whole(file, hidden_beside, [mode](const fs::path& name) {
    return ::open(name.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, mode);
  });
  const Descriptor& descriptor = whole.descriptor();
  if (!descriptor.is_open() || !write_all(descriptor, text) || !whole.finish()) throw unwritten(reason());
}

fs::path temporary_beside(const fs::path& final) { return final.string() + mark_of_temporary(); }

fs::path hidden_beside(const fs::path& final) { return final.parent_path() / mark_of_temporary(); }

bool is_hidden_temporary(const fs::path& file) { return file.filename().native().starts_with(kMark); }

AtomicFile::AtomicFile(fs::path final, NameBeside name_beside, const OpenNew& open_new) : final_(std::move(final)) {
  // A name may be taken: a killed process of the same identity left it.
  do {
    temporary_ = name_beside(final_);
    descriptor_ = Descriptor(open_new(temporary_));
  } while (!descriptor_.is_open() && (errno == EEXIST || errno == EINTR));
}

AtomicFile::~AtomicFile() {
  if (descriptor_.is_open()) unlink(temporary_.c_str());
}

bool AtomicFile::finish(bool is_durable) {
  if ((!is_durable || fsync(descriptor_) == 0) && descriptor_.close() &&
      std::rename(temporary_.c_str(), final_.c_str()) == 0)
    return true;
  const int number = errno;
  unlink(temporary_.c_str());
  descriptor_.close();
  errno = number;
  return false;
}

}  // namespace marrow
