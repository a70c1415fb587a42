// SPDX-License-Identifier: Apache-2.0
// A stack that is cut off at its end looks like one with fewer pages. So the chain of page directories is followed
// here. If a directory or pixels lie beyond the end of the file, pages are missing. Directories that form a circle or
// share their bytes are refused, so the file's size bounds all work.
#include "tiff_pages.hpp"

#include <algorithm>
#include <stdexcept>
#include <unordered_set>
#include <utility>

#include "marrow/base/error.hpp"
#include "marrow/base/number_text.hpp"
#include "tiff_description.hpp"

namespace marrow::files {
namespace {

constexpr std::size_t kMostPages = 100000;
constexpr std::uint64_t kLongestDescription = 1 << 20;

/// Sizes in bytes: BigTIFF (43) has 8-byte offsets and 20-byte entries, TIFF (42) 4 and 12.
struct Layout {
  int width, count_width;
  std::uint64_t entry_bytes;
};

class Walk {
 public:
  explicit Walk(const InputFile& file) : file_(file), window_(file) {}

  TiffPages all() {
    const std::string order = window_.holds(0, 2) ? window_.text(0, 2) : "";
    tiff_.big_endian = order == "MM";
    if (order != "MM" && order != "II") throw Error(what() + ": is not a TIFF file, or is damaged at its start");
    try {
      follow();
    } catch (const std::out_of_range&) {
      throw Error(formatted("{}: is cut off or damaged: only {} pages are whole; copy or export it again", what(),
                            tiff_.pages.size()));
    }
    if (tiff_.pages.empty()) throw Error(what() + ": has no page");
    check_pages_told();
    return std::move(tiff_);
  }

 private:
  std::string what() const { return file_.path().string(); }
  std::uint64_t number(std::uint64_t at, int width) { return window_.number(at, width, tiff_.big_endian); }

  void follow() {
    const std::uint64_t version = number(2, 2);
    if (version != 42 && version != 43) throw Error(what() + ": is not a TIFF file, or is damaged at its start");
    const bool is_big = version == 43;
    layout_ = is_big ? Layout{8, 8, 20} : Layout{4, 2, 12};
    std::unordered_set<std::uint64_t> visited;
    std::uint64_t at = number(is_big ? 8 : 4, layout_.width);
    while (at != 0) {
      if (!visited.insert(at).second)
        throw Error(what() + ": its pages run in a circle; it is damaged: copy or export it again");
      if (tiff_.pages.size() == kMostPages) throw Error(what() + ": has more than 100000 pages");
      const std::uint64_t entries = number(at, layout_.count_width);
      if (entries > 65535) throw std::out_of_range("entries");
      const std::uint64_t first_entry = at + std::uint64_t(layout_.count_width);
      add(read_page(first_entry, entries));
      at = number(first_entry + entries * layout_.entry_bytes, layout_.width);
    }
  }

  /// Refuses pages that share bytes, because reading all of them could take very long.
  void count_bytes(std::uint64_t bytes) {
    bytes_ += bytes;
    if (bytes_ > 4 * file_.size() + 65536)
      throw Error(what() + ": its pages lie over each other; it is damaged: copy or export it again");
  }

  void add(TiffPage page) {
    // Tiles are not supported: they would have to be put together.
    if (page.is_tiled)
      throw Error(what() + ": is stored in tiles; expected strips: save it as a plain TIFF (tiffcp -s does it)");
    if (!tiff_.pages.empty() && !page.is_like(tiff_.pages[0]))
      throw Error(
          formatted("{}: page {} has another size or kind of pixels than page 1; save pages that belong together in a "
                    "file of their own",
                    what(), tiff_.pages.size() + 1));
    tiff_.pages.push_back(std::move(page));
  }

  TiffPage read_page(std::uint64_t first_entry, std::uint64_t entries) {
    count_bytes(entries * layout_.entry_bytes);
    if (!window_.holds(first_entry, entries * layout_.entry_bytes)) throw std::out_of_range("entries");
    TiffPage page;
    std::vector<std::uint64_t> places, lengths;
    TiffDescription description;
    for (std::uint64_t i = 0; i < entries; ++i) {
      const std::uint64_t entry = first_entry + i * layout_.entry_bytes, tag = number(entry, 2);
      if (tag == 273) places = numbers_of(entry);
      if (tag == 270) description = check_description(entry);
      if (tag == 279) lengths = numbers_of(entry);
      if (tag == 320) page.palette = numbers_of(entry);
      if (tag == 322 || tag == 324) page.is_tiled = true;
      if (std::uint64_t* const place = place_of(page, tag)) {
        const auto numbers = numbers_of(entry);
        if (numbers.empty())
          throw Error(formatted(
              "{}: its field {} has no number of a kind that is read; it is damaged, or save it again as a plain TIFF",
              what(), tag));
        *place = numbers[0];
        // The samples of a pixel may have different widths and formats. This is not supported: 0 is refused later.
        if (std::any_of(numbers.begin(), numbers.end(), [&](std::uint64_t n) { return n != numbers[0]; })) *place = 0;
      }
    }
    check_strips(places, lengths, page);
    page.told = description.pages;
    if (description.samples == 0 || page.is_tiled || page.samples < 1 || page.samples > 1000) return page;
    const std::uint64_t each = page.width * page.height * page.samples;
    if (description.samples % each == 0) page.told = description.samples / each;
    return page;
  }

  TiffDescription check_description(std::uint64_t entry) {
    const std::uint64_t type = number(entry + 2, 2), count = number(entry + 4, layout_.width);
    if (type != 2 || count <= std::uint64_t(layout_.width)) return {};
    const std::uint64_t at = number(entry + 4 + std::uint64_t(layout_.width), layout_.width);
    if (!window_.holds(at, count)) throw std::out_of_range("description");
    const std::uint64_t length = std::min(count, kLongestDescription);
    count_bytes(length);
    const std::string text = window_.text(at, length);
    if (length < count && text.find('<') != std::string::npos)  // its rest may describe the pages
      throw Error(formatted("{}: its description has {} bytes, more than the {} that are read; save it without", what(),
                            count, kLongestDescription));
    TiffDescription description = read_tiff_description(text);
    if (description.is_truncated)
      throw Error(what() +
                  ": its first page stands for several, of which the others have no directory (tifffile's "
                  "'truncated'); save it without");
    if (tiff_.other_pages.empty()) tiff_.other_pages = description.other_pages;
    take_calibration(description);
    return description;
  }

  /// The calibration of the first page holds for all pages. Throws Error if another page has a different one.
  void take_calibration(const TiffDescription& description) {
    if (!description.calibration.empty())
      throw Error(what() + ": " + description.calibration + "; save it uncalibrated (in ImageJ: Analyze, Calibrate)");
    const bool is_other = description.slope != tiff_.slope || description.intercept != tiff_.intercept;
    if (is_other && !tiff_.pages.empty() && (description.slope != 1 || description.intercept != 0))
      throw Error(formatted("{}: page {} is calibrated otherwise than page 1; save it uncalibrated", what(),
                            tiff_.pages.size() + 1));
    if (tiff_.pages.empty()) tiff_.slope = description.slope, tiff_.intercept = description.intercept;
  }

  /// Descriptions give the number of pages of a stack. If it differs from the number found, pages are missing, or there
  /// are several stacks.
  void check_pages_told() {
    std::uint64_t most = 0, different = 0, single = 0;
    for (const TiffPage& page : tiff_.pages) {
      most = std::max(most, page.told);
      if (page.told == 1) ++single;
      if (page.told != 0 && page.told != tiff_.pages.size()) ++different;
    }
    if (most > tiff_.pages.size())
      throw Error(formatted(
          "{}: {}its description tells of {} pages, but it has {}: the others have no directory, or are in other "
          "files; save it with a directory for each page",
          what(), tiff_.other_pages.empty() ? "" : "is " + tiff_.other_pages + "; ", most, tiff_.pages.size()));
    // If each page describes itself as the only one, the file was written page by page.
    if (different > 0 && single != tiff_.pages.size() && tiff_.other_pages.empty())
      tiff_.other_pages = formatted("a file of several stacks (its first page tells of {} of the {} pages)",
                                    std::max<std::uint64_t>(1, tiff_.pages[0].told), tiff_.pages.size());
  }

  static std::uint64_t* place_of(TiffPage& page, std::uint64_t tag) {
    static constexpr std::pair<std::uint64_t, std::uint64_t TiffPage::*> kFields[] = {
        {254, &TiffPage::subfile},        {256, &TiffPage::width},       {257, &TiffPage::height},
        {258, &TiffPage::bits},           {259, &TiffPage::compression}, {262, &TiffPage::photometric},
        {266, &TiffPage::fill_order},     {274, &TiffPage::orientation}, {277, &TiffPage::samples},
        {278, &TiffPage::rows_per_strip}, {284, &TiffPage::planes},      {317, &TiffPage::predictor},
        {339, &TiffPage::format}};
    for (const auto& [known, place] : kFields)
      if (known == tag) return &(page.*place);
    return nullptr;
  }

  /// The numbers of an entry. They are in the entry itself or, if there are too many, elsewhere in the file.
  std::vector<std::uint64_t> numbers_of(std::uint64_t entry) {
    const std::uint64_t type = number(entry + 2, 2), count = number(entry + 4, layout_.width);
    const int bytes_each = type == 1 ? 1 : type == 3 ? 2 : type == 4 ? 4 : type == 16 ? 8 : 0;
    if (bytes_each == 0) return {};
    std::uint64_t at = entry + 4 + std::uint64_t(layout_.width);
    if (count > file_.size()) throw std::out_of_range("count");
    if (count * std::uint64_t(bytes_each) > std::uint64_t(layout_.width)) at = number(at, layout_.width);
    if (!window_.holds(at, count * std::uint64_t(bytes_each))) throw std::out_of_range("value");
    count_bytes(count * std::uint64_t(bytes_each));
    std::vector<std::uint64_t> numbers;
    numbers.reserve(count);
    for (std::uint64_t i = 0; i < count; ++i) numbers.push_back(number(at + i * std::uint64_t(bytes_each), bytes_each));
    return numbers;
  }

  void check_strips(const std::vector<std::uint64_t>& places, const std::vector<std::uint64_t>& lengths,
                    TiffPage& page) {
    if (page.is_tiled) return;
    if (!(page.width >= 1 && page.width <= 100000 && page.height >= 1 && page.height <= 100000 &&
          page.rows_per_strip >= 1))
      throw Error(formatted("{}: page {} has a size of {} x {} pixels; it is damaged", what(), tiff_.pages.size() + 1,
                            page.width, page.height));
    page.rows_per_strip = std::min(page.rows_per_strip, page.height);
    const std::uint64_t strips = (page.height + page.rows_per_strip - 1) / page.rows_per_strip *
                                 (page.planes == 2 ? std::min<std::uint64_t>(page.samples, 1000) : 1);
    if (page.samples <= 4 && (places.size() != strips || lengths.size() != strips)) throw std::out_of_range("strips");
    for (std::size_t i = 0; i < std::min(places.size(), lengths.size()); ++i) {
      if (!window_.holds(places[i], lengths[i])) throw std::out_of_range("pixels");
      count_bytes(lengths[i]);
      page.strips.push_back({places[i], lengths[i]});
    }
  }

  const InputFile& file_;
  FileWindow window_;
  Layout layout_{};
  TiffPages tiff_;
  std::uint64_t bytes_ = 0;
};

}  // namespace

TiffPages read_tiff_pages(const InputFile& file) { return Walk(file).all(); }

}  // namespace marrow::files
