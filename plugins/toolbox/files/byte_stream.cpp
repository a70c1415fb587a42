// SPDX-License-Identifier: Apache-2.0
#include "byte_stream.hpp"

#include <zlib.h>

#include <algorithm>

#include "marrow/base/error.hpp"

namespace marrow::files {
namespace {

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

}  // namespace

std::unique_ptr<ByteStream> plain_bytes(const InputFile& file, std::uint64_t begin, std::uint64_t end) {
  return std::make_unique<PlainBytes>(file, begin, end);
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
