// SPDX-License-Identifier: Apache-2.0
#include "marrow/toolbox/files/input_file.hpp"

#include <fcntl.h>
#include <sys/stat.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <stdexcept>

#include "marrow/base/error.hpp"
#include "marrow/base/number_text.hpp"
#include "marrow/base/plain_text.hpp"
#include "marrow/runtime/node/context.hpp"

namespace marrow::files {
namespace {

constexpr std::size_t kWindow = 16384;

}  // namespace

InputFile::InputFile(std::filesystem::path path, bool may_be_empty)
    : path_(std::move(path)), descriptor_(::open(path_.c_str(), O_RDONLY | O_CLOEXEC | O_NONBLOCK)) {
  const int reason = errno;
  const std::string what = path_.string();
  if (!descriptor_.is_open()) {
    if (reason == ENOENT || reason == ENOTDIR) throw Error(what + ": there is no such file");
    if (reason == ELOOP) throw Error(what + ": is a link that leads back to itself");
    if (reason == ENXIO) throw Error(what + ": expected a file, this is none");
    throw Error(what + ": cannot be read (" + std::strerror(reason) + ")");
  }
  struct stat status {};
  if (::fstat(descriptor_, &status) != 0 || !S_ISREG(status.st_mode))
    throw Error(what + ": expected a file, this is none");
  if (status.st_size == 0 && !may_be_empty) throw Error(what + ": the file is empty");
  size_ = std::uint64_t(status.st_size);
  now_reading(path_);
}

void InputFile::read(std::uint64_t at, void* to, std::size_t count) const {
  const std::int64_t got = read_at(descriptor_, to, count, at);
  if (got < 0) throw Error(path_.string() + ": cannot be read (" + std::strerror(errno) + ")");
  if (std::size_t(got) < count)
    throw Error(path_.string() + ": became shorter while it was read; try again when nothing writes it");
}

std::string InputFile::text(std::uint64_t at, std::size_t count) const {
  std::string bytes(count, '\0');
  read(at, bytes.data(), count);
  return bytes;
}

std::string read_bytes(const std::filesystem::path& path, std::uint64_t most, bool may_be_empty) {
  const InputFile file(path, may_be_empty);
  if (file.size() > most)
    throw Error(formatted("{}: has {} bytes; at most {} are read", path.string(), file.size(), most));
  return file.text(0, std::size_t(file.size()));
}

std::string read_text(const std::filesystem::path& path, std::uint64_t most, bool may_be_empty) {
  return plain_text(read_bytes(path, most, may_be_empty));
}

const char* FileWindow::bytes(std::uint64_t at, std::size_t count) {
  if (!holds(at, count)) throw std::out_of_range("behind the end");
  if (at < begin_ || at + count > begin_ + part_.size()) {
    part_.resize(std::size_t(std::min<std::uint64_t>(std::max(count, kWindow), size_ - at)));
    file_->read(at, part_.data(), part_.size());
    begin_ = at;
  }
  return part_.data() + (at - begin_);
}

std::uint64_t number_in_bytes(std::string_view bytes, bool big_endian) {
  std::uint64_t value = 0;
  for (std::size_t i = 0; i < bytes.size(); ++i)
    value = value << 8 | std::uint8_t(bytes[big_endian ? i : bytes.size() - 1 - i]);
  return value;
}

std::uint64_t FileWindow::number(std::uint64_t at, int width, bool big_endian) {
  return number_in_bytes({bytes(at, std::size_t(width)), std::size_t(width)}, big_endian);
}

std::string FileWindow::text(std::uint64_t at, std::size_t count) { return {bytes(at, count), count}; }

void check_stays_inside(const std::filesystem::path& folder, const std::filesystem::path& file) {
  std::error_code failure;
  if (!std::filesystem::is_symlink(std::filesystem::symlink_status(file, failure))) return;
  const std::filesystem::path target = std::filesystem::canonical(file, failure);
  if (failure) throw Error(file.string() + ": is a link that leads nowhere; copy the file itself into the folder");
  const std::filesystem::path inside = target.lexically_relative(std::filesystem::canonical(folder, failure));
  if (failure || inside.empty() || *inside.begin() == "..")
    throw Error(file.string() + ": is a link to a place outside the folder; copy the file itself into the folder");
}

}  // namespace marrow::files
