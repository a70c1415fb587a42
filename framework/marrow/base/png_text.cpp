// SPDX-License-Identifier: Apache-2.0
#include "marrow/base/png_text.hpp"

#include <boost/crc.hpp>
#include <cstdint>
#include <functional>

#include "marrow/base/error.hpp"

namespace marrow {
namespace {

constexpr std::string_view kSignature = "\x89PNG\r\n\x1a\n";
constexpr std::string_view kTextType = "iTXt";
constexpr std::size_t kFrameBytes = 12;  ///< of a chunk, besides its data: length, type and check sum

std::string big_endian(std::uint32_t number) {
  std::string bytes;
  for (int shift = 24; shift >= 0; shift -= 8) bytes += char(number >> shift & 0xff);
  return bytes;
}

std::uint32_t number_at(std::string_view bytes, std::size_t at) {
  std::uint32_t number = 0;
  for (std::size_t i = 0; i < 4; ++i) number = number << 8 | static_cast<unsigned char>(bytes[at + i]);
  return number;
}

struct Chunk {
  std::string_view type, data, whole;

  std::uint32_t check_sum() const {
    boost::crc_32_type sum;
    sum.process_bytes(whole.data() + 4, 4 + data.size());  // of the type and the data
    return sum.checksum();
  }
  bool is_text_of(std::string_view keyword) const {
    return type == kTextType && data.size() > keyword.size() && data.starts_with(keyword) && !data[keyword.size()];
  }
};

void for_each_chunk(std::string_view png, const std::function<void(const Chunk&)>& use) {
  if (!is_png(png)) throw Error("it is no PNG file");
  std::string_view last;
  for (std::size_t at = kSignature.size(); last != "IEND";) {
    if (png.size() - at < kFrameBytes || number_at(png, at) > png.size() - at - kFrameBytes)
      throw Error("the PNG file ends too early");
    const std::size_t size = number_at(png, at);
    last = png.substr(at + 4, 4);
    use({last, png.substr(at + 8, size), png.substr(at, size + kFrameBytes)});
    at += size + kFrameBytes;
  }
}

std::string text_chunk(std::string_view keyword, std::string_view text) {
  std::string data(keyword);
  data.append(5, '\0');  // the keyword's end; not compressed; compression method; no language; no translated keyword
  data += text;
  std::string whole = big_endian(std::uint32_t(data.size())) + std::string(kTextType) + data;
  return whole + big_endian(Chunk{kTextType, data, whole}.check_sum());
}

/// `added`: a chunk to put after the header, or nothing.
std::string rewritten(std::string_view png, std::string_view keyword, const std::string& added) {
  std::string result(kSignature);
  for_each_chunk(png, [&](const Chunk& chunk) {
    if (!chunk.is_text_of(keyword)) result += chunk.whole;
    if (chunk.type == "IHDR") result += added;
  });
  return result;
}

}  // namespace

bool is_png(std::string_view bytes) { return bytes.starts_with(kSignature); }

std::string with_png_text(std::string_view png, std::string_view keyword, std::string_view text) {
  return rewritten(png, keyword, text_chunk(keyword, text));
}

std::string without_png_text(std::string_view png, std::string_view keyword) { return rewritten(png, keyword, ""); }

std::optional<std::string> png_text(std::string_view png, std::string_view keyword) {
  std::optional<std::string> text;
  for_each_chunk(png, [&](const Chunk& chunk) {
    if (!chunk.is_text_of(keyword) || text) return;
    if (chunk.check_sum() != number_at(chunk.whole, chunk.whole.size() - 4))
      throw Error("the text of the PNG file was changed: its check sum is another one");
    std::string_view rest = chunk.data.substr(keyword.size() + 1);
    if (rest.size() > 1 && rest[0]) throw Error("another program has compressed the text of the PNG file");
    rest.remove_prefix(std::min<std::size_t>(2, rest.size()));
    for (int skipped = 0; skipped < 2; ++skipped) {  // the language, and the keyword in it
      const std::size_t end = rest.find('\0');
      if (end == rest.npos) throw Error("the text of the PNG file is not whole");
      rest.remove_prefix(end + 1);
    }
    text = rest;
  });
  return text;
}

}  // namespace marrow
