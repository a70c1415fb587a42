// SPDX-License-Identifier: Apache-2.0
// libtiff takes a stack whose end is cut off as one with fewer pages. So the chain of page directories is followed
// here: an entry that points behind the end of the file means that pages are missing.
#include <fstream>
#include <stdexcept>

#include "marrow/domain/error.hpp"
#include "samples.hpp"

namespace marrow::read {
namespace {

class Bytes {
 public:
  explicit Bytes(const std::filesystem::path& path) {
    std::ifstream stream(path, std::ios::binary);
    bytes_.assign(std::istreambuf_iterator<char>(stream), {});
    big_endian_ = bytes_.rfind("MM", 0) == 0;
  }
  /// The unsigned number of `width` bytes at a place; throws std::out_of_range behind the end.
  std::uint64_t number(std::uint64_t at, int width) const {
    std::uint64_t value = 0;
    for (int i = 0; i < width; ++i) {
      const std::uint64_t byte = std::uint8_t(bytes_.at(at + std::uint64_t(big_endian_ ? i : width - 1 - i)));
      value = value << 8 | byte;
    }
    return value;
  }
  bool is_tiff() const { return big_endian_ || bytes_.rfind("II", 0) == 0; }

 private:
  std::string bytes_;
  bool big_endian_ = false;
};

}  // namespace

void check_tiff_pages(const std::filesystem::path& path) {
  const Bytes bytes(path);
  if (!bytes.is_tiff()) throw Error(path.string() + ": is not a TIFF file, or is damaged at its start");
  constexpr std::size_t kMostPages = 100000;
  std::size_t pages = 0;
  try {
    // BigTIFF (43) has 8-byte places and 20-byte entries, TIFF (42) 4 and 12.
    const bool is_big = bytes.number(2, 2) == 43;
    const int width = is_big ? 8 : 4, count_width = is_big ? 8 : 2;
    const std::uint64_t entry_bytes = is_big ? 20 : 12;
    std::uint64_t at = bytes.number(is_big ? 8 : 4, width);
    for (; at != 0; ++pages) {
      if (pages == kMostPages)
        throw Error(path.string() + ": has more than 100000 pages, or its pages run in a circle");
      const std::uint64_t entries = bytes.number(at, count_width);
      if (entries > 65535) throw std::out_of_range("entries");
      at = bytes.number(at + std::uint64_t(count_width) + entries * entry_bytes, width);
    }
  } catch (const std::out_of_range&) {
    throw Error(path.string() + ": is cut off or damaged: only " + std::to_string(pages) + " pages are whole");
  }
  if (pages == 0) throw Error(path.string() + ": has no page");
}

}  // namespace marrow::read
