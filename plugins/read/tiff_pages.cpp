// SPDX-License-Identifier: Apache-2.0
// libtiff takes a stack whose end is cut off as one with fewer pages. So the chain of page directories is followed
// here: a directory, or pixels, behind the end of the file mean that pages are missing.
#include <algorithm>
#include <fstream>
#include <stdexcept>
#include <vector>

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
  std::uint64_t size() const { return bytes_.size(); }
  bool is_tiff() const { return big_endian_ || bytes_.rfind("II", 0) == 0; }

 private:
  std::string bytes_;
  bool big_endian_ = false;
};

/// The widths of places and entries: BigTIFF (43) has 8-byte places and 20-byte entries, TIFF (42) 4 and 12.
struct Layout {
  int width, count_width;
  std::uint64_t entry_bytes;
};

/// Throws std::out_of_range when the value of an entry, of whatever type, ends behind the file: libtiff reserves what it claims.
void check_value(const Bytes& bytes, const Layout& layout, std::uint64_t entry) {
  static constexpr int kBytesEach[] = {0, 1, 1, 2, 4, 8, 1, 1, 2, 4, 8, 4, 8, 4, 0, 0, 8, 8, 8};
  const std::uint64_t type = bytes.number(entry + 2, 2), count = bytes.number(entry + 4, layout.width);
  const std::uint64_t bytes_each = type < std::size(kBytesEach) ? std::uint64_t(kBytesEach[type]) : 0;
  if (count > bytes.size()) throw std::out_of_range("count");
  if (count * bytes_each <= std::uint64_t(layout.width)) return;
  const std::uint64_t at = bytes.number(entry + 4 + std::uint64_t(layout.width), layout.width);
  if (at > bytes.size() || count * bytes_each > bytes.size() - at) throw std::out_of_range("value");
}

/// The numbers of an entry, which lie in it or, where they are too many, elsewhere.
std::vector<std::uint64_t> numbers_of(const Bytes& bytes, const Layout& layout, std::uint64_t entry) {
  const std::uint64_t type = bytes.number(entry + 2, 2), count = bytes.number(entry + 4, layout.width);
  const int bytes_each = type == 3 ? 2 : type == 4 ? 4 : type == 16 ? 8 : 0;
  if (bytes_each == 0) return {};
  std::uint64_t at = entry + 4 + std::uint64_t(layout.width);
  if (count > bytes.size()) throw std::out_of_range("count");
  if (count * std::uint64_t(bytes_each) > std::uint64_t(layout.width)) at = bytes.number(at, layout.width);
  std::vector<std::uint64_t> numbers;
  for (std::uint64_t i = 0; i < count; ++i)
    numbers.push_back(bytes.number(at + i * std::uint64_t(bytes_each), bytes_each));
  return numbers;
}

/// What all pages of a stack have in common.
struct Page {
  std::uint64_t width = 0, height = 0, bits = 1, samples = 1;
  bool is_tiled = false;
  bool operator==(const Page&) const = default;
};

/// Throws std::out_of_range when a value of the page whose entries begin here, or its strips or tiles, end behind the file, or when
/// uncompressed pixels are fewer than the page's size takes.
Page check_page(const Bytes& bytes, const Layout& layout, std::uint64_t first_entry, std::uint64_t entries) {
  std::vector<std::uint64_t> places, lengths;
  Page page;
  bool is_packed = false;
  for (std::uint64_t i = 0; i < entries; ++i) {
    const std::uint64_t entry = first_entry + i * layout.entry_bytes, tag = bytes.number(entry, 2);
    check_value(bytes, layout, entry);
    const std::vector<std::uint64_t> numbers = numbers_of(bytes, layout, entry);
    if (tag == 273 || tag == 324) places = numbers;
    if (tag == 279 || tag == 325) lengths = numbers;
    if (numbers.empty()) continue;
    if (tag == 256) page.width = numbers[0];
    if (tag == 257) page.height = numbers[0];
    if (tag == 258) page.bits = numbers[0];
    if (tag == 322) page.is_tiled = true;
    if (tag == 277) page.samples = numbers[0];
    if (tag == 259) is_packed = numbers[0] != 1;
  }
  double stored = 0;
  for (std::size_t i = 0; i < std::min(places.size(), lengths.size()); ++i) {
    if (places[i] > bytes.size() || lengths[i] > bytes.size() - places[i]) throw std::out_of_range("pixels");
    stored += double(lengths[i]);
  }
  if (!is_packed && !lengths.empty() && double(page.width) * double(page.height) * double(page.bits * page.samples) / 8 > stored)
    throw std::out_of_range("size");
  return page;
}

}  // namespace

void check_tiff_pages(const std::filesystem::path& path) {
  const Bytes bytes(path);
  if (!bytes.is_tiff()) throw Error(path.string() + ": is not a TIFF file, or is damaged at its start");
  constexpr std::size_t kMostPages = 100000;
  std::size_t pages = 0;
  Page first;
  try {
    const bool is_big = bytes.number(2, 2) == 43;
    const Layout layout = is_big ? Layout{8, 8, 20} : Layout{4, 2, 12};
    std::uint64_t at = bytes.number(is_big ? 8 : 4, layout.width);
    for (; at != 0; ++pages) {
      if (pages == kMostPages)
        throw Error(path.string() + ": has more than 100000 pages, or its pages run in a circle");
      const std::uint64_t entries = bytes.number(at, layout.count_width);
      if (entries > 65535) throw std::out_of_range("entries");
      const std::uint64_t first_entry = at + std::uint64_t(layout.count_width);
      const Page page = check_page(bytes, layout, first_entry, entries);
      if (pages == 0) first = page;
      // ITK would read tiles as colours of 8 bits.
      if (page.is_tiled)
        throw Error(path.string() + ": is stored in tiles; expected strips: save it as a plain TIFF (tiffcp -s does it)");
      if (page != first)
        throw Error(path.string() + ": page " + std::to_string(pages + 1) + " has another size or kind of pixels than page 1; save pages "
                    "that belong together in a file of their own");
      at = bytes.number(first_entry + entries * layout.entry_bytes, layout.width);
    }
  } catch (const std::out_of_range&) {
    throw Error(path.string() + ": is cut off or damaged: only " + std::to_string(pages) +
                " pages are whole; copy or export it again");
  }
  if (pages == 0) throw Error(path.string() + ": has no page");
}

}  // namespace marrow::read
