// SPDX-License-Identifier: Apache-2.0
#include "marrow/toolbox/files/input_file.hpp"

#include <fcntl.h>
#include <sys/stat.h>

#include <zlib.h>
#include <algorithm>
#include <cerrno>
#include <cstring>
#include <stdexcept>

#include "marrow/base/number_text.hpp"
#include "marrow/base/plain_text.hpp"
#include "marrow/runtime/node/context.hpp"

namespace marrow::files {
namespace {

constexpr std::size_t kWindow = 16384;

class PlainBytes final : public ByteStream {
 public:
  PlainBytes(const InputFile& file, std::uint64_t begin, std::uint64_t end)
      : file_(file), at_(std::min(begin, file.size())), end_(std::clamp(end, at_, file.size())) {}
  std::size_t take(void* to, std::size_t count) override {
    count = std::size_t(std::min<std::uint64_t>(count, end_ - at_));
    file_.read(at_, to, count);
    at_ += count;
    return count;
  }
  std::uint64_t bytes_behind() const override { return end_ - at_; }

 private:
  const InputFile& file_;
  std::uint64_t at_, end_;
};

class UnpackedBytes final : public ByteStream {
 public:
  /// `window_bits` as zlib takes them: they tell which header and checksum there are.
  UnpackedBytes(const InputFile& file, std::uint64_t begin, std::uint64_t end, int window_bits)
      : file_(file), packed_(file, begin, end), in_(1 << 16) {
    if (inflateInit2(&unpacker_, window_bits) != Z_OK) throw Error("zlib does not start");
  }
  ~UnpackedBytes() override { inflateEnd(&unpacker_); }

  std::size_t take(void* to, std::size_t count) override {
    unpacker_.next_out = static_cast<unsigned char*>(to);
    std::size_t left = count;
    while (left > 0 && !ended_) {
      const unsigned part = unsigned(std::min<std::size_t>(left, 1 << 30));
      unpacker_.avail_out = part;
      step();
      left -= part - unpacker_.avail_out;
    }
    return count - left;
  }
  std::uint64_t bytes_behind() const override { return unpacker_.avail_in + packed_.bytes_behind(); }

 private:
  void step() {
    if (unpacker_.avail_in == 0) {
      unpacker_.avail_in = unsigned(packed_.take(in_.data(), in_.size()));
      unpacker_.next_in = in_.data();
    }
    const int state = inflate(&unpacker_, Z_NO_FLUSH);
    if (state == Z_STREAM_END) {
      ended_ = !next_member();
    } else if (state == Z_BUF_ERROR && unpacker_.avail_in == 0) {
      throw Error(file_.path().string() + ": is cut off: its compressed samples have no end; copy or export it again");
    } else if (state != Z_OK && state != Z_BUF_ERROR) {
      throw Error(file_.path().string() + ": is damaged: its compressed samples do not unpack" +
                  (unpacker_.msg ? " (" + std::string(unpacker_.msg) + ")" : "") + "; copy or export it again");
    }
  }
  /// A gzip file may consist of several members one after the other; parallel compressors write such files.
  bool next_member() {
    if (unpacker_.avail_in == 0) {
      unpacker_.avail_in = unsigned(packed_.take(in_.data(), in_.size()));
      unpacker_.next_in = in_.data();
    }
    return unpacker_.avail_in > 0 && unpacker_.next_in[0] == 0x1F && inflateReset(&unpacker_) == Z_OK;
  }

  const InputFile& file_;
  PlainBytes packed_;
  std::vector<unsigned char> in_;
  z_stream unpacker_ = {};
  bool ended_ = false;
};

/// The bytes of a file between two offsets. The file must outlive the stream.
std::unique_ptr<ByteStream> plain_bytes(const InputFile& file, std::uint64_t begin, std::uint64_t end) {
  return std::make_unique<PlainBytes>(file, begin, end);
}

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

std::unique_ptr<ByteStream> unpacked_bytes(const InputFile& file, std::uint64_t begin, std::uint64_t end) {
  return std::make_unique<UnpackedBytes>(file, begin, end, 15 + 32);  // 32: zlib or gzip
}

std::unique_ptr<ByteStream> bare_unpacked_bytes(const InputFile& file, std::uint64_t begin, std::uint64_t end) {
  return std::make_unique<UnpackedBytes>(file, begin, end, -15);
}

std::unique_ptr<ByteStream> bytes_of_gzip_or_plain(const InputFile& file) {
  const bool is_packed = file.size() >= 2 && file.text(0, 2) == "\x1F\x8B";
  return is_packed ? unpacked_bytes(file, 0, file.size()) : plain_bytes(file, 0, file.size());
}

void take_all(ByteStream& stream, const InputFile& file, void* to, std::size_t count) {
  const std::size_t got = stream.take(to, count);
  if (got < count)
    throw Error(file.path().string() +
                ": is cut off or damaged: it holds fewer bytes than its header claims; copy or export it again");
}

void expect_end(ByteStream& stream, const InputFile& file) {
  char more = 0;
  if (stream.take(&more, 1) > 0)
    throw Error(file.path().string() +
                ": is damaged: it holds more samples than its header claims; copy or export it again");
}

}  // namespace marrow::files
