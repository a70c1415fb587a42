// SPDX-License-Identifier: Apache-2.0
// A stack that is cut off at its end looks like one with fewer pages. So what descriptions tell of its pages is
// compared with what is there.
#include "tiff_pages.hpp"

#include <algorithm>
#include <utility>

#include "marrow/base/error.hpp"
#include "marrow/base/number_text.hpp"
#include "tiff_description.hpp"

namespace marrow::files {
namespace {

constexpr std::size_t kMostPages = 100000, kLongestDescription = 1 << 20, kLongestSide = 100000;

class Walk {
 public:
  explicit Walk(const InputFile& file) : reader_(file), what_(file.path().string()) {}

  TiffPages all() {
    do add(reader_.page());
    while (reader_.next());
    check_pages_told();
    return std::move(tiff_);
  }

 private:
  void add(TiffPage page) {
    if (tiff_.pages.size() == kMostPages) throw Error(what_ + ": has more than 100000 pages");
    if (page.is_tiled)  // tiles would have to be put together
      throw Error(what_ + ": is stored in tiles; expected strips: save it as a plain TIFF (tiffcp -s does it)");
    if (page.width < 1 || page.height < 1 || std::max(page.width, page.height) > kLongestSide)
      throw Error(formatted("{}: page {} has a size of {} x {} pixels; it is damaged", what_, tiff_.pages.size() + 1,
                            page.width, page.height));
    if (!tiff_.pages.empty() && !page.is_like(tiff_.pages[0]))
      throw Error(
          formatted("{}: page {} has another size or kind of pixels than page 1; save pages that belong together in a "
                    "file of their own",
                    what_, tiff_.pages.size() + 1));
    const TiffDescription description = checked_description();
    const std::uint64_t each = std::uint64_t(page.width) * page.height * page.samples;
    page.told = description.pages;
    if (description.samples != 0 && description.samples % each == 0) page.told = description.samples / each;
    tiff_.pages.push_back(std::move(page));
  }

  TiffDescription checked_description() {
    const std::string text = reader_.description();
    if (text.size() > kLongestDescription && text.find('<') != std::string::npos)  // it may describe the pages
      throw Error(formatted("{}: its description has {} bytes, more than the {} that are read; save it without", what_,
                            text.size(), kLongestDescription));
    TiffDescription description = read_tiff_description(text.substr(0, kLongestDescription));
    if (description.is_truncated)
      throw Error(what_ +
                  ": its first page stands for several, of which the others have no directory (tifffile's "
                  "'truncated'); save it without");
    if (tiff_.other_pages.empty()) tiff_.other_pages = description.other_pages;
    take_calibration(description);
    return description;
  }

  /// The calibration of the first page holds for all pages. Throws Error if another page has a different one.
  void take_calibration(const TiffDescription& description) {
    if (!description.calibration.empty())
      throw Error(what_ + ": " + description.calibration + "; save it uncalibrated (in ImageJ: Analyze, Calibrate)");
    const bool is_other = description.slope != tiff_.slope || description.intercept != tiff_.intercept;
    if (is_other && !tiff_.pages.empty() && (description.slope != 1 || description.intercept != 0))
      throw Error(formatted("{}: page {} is calibrated otherwise than page 1; save it uncalibrated", what_,
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
          what_, tiff_.other_pages.empty() ? "" : "is " + tiff_.other_pages + "; ", most, tiff_.pages.size()));
    // If each page describes itself as the only one, the file was written page by page.
    if (different > 0 && single != tiff_.pages.size() && tiff_.other_pages.empty())
      tiff_.other_pages = formatted("a file of several stacks (its first page tells of {} of the {} pages)",
                                    std::max<std::uint64_t>(1, tiff_.pages[0].told), tiff_.pages.size());
  }

  TiffReader reader_;
  std::string what_;
  TiffPages tiff_;
};

}  // namespace

TiffPages read_tiff_pages(const InputFile& file) { return Walk(file).all(); }

}  // namespace marrow::files
