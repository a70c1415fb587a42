// SPDX-License-Identifier: Apache-2.0
// A stack that is cut off at its end looks like one with fewer pages. So what descriptions tell of its pages is
// compared with what is there.
#include "tiff_pages.hpp"

#include <tiffio.h>
#include <algorithm>
#include <cstdarg>
#include <cstdio>

#include "marrow/base/error.hpp"
#include "marrow/base/number_text.hpp"

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

/// These say nothing about pixels: fields that programs add, texts without an end, fields in another order.
bool is_harmless(const std::string& message) {
  for (const char* part : {"Unknown field with tag", "does not end in null byte", "tags are not sorted"})
    if (message.find(part) != std::string::npos) return true;
  return false;
}

template <class Source>
int keep_message(TIFF*, void* to, const char*, const char* format, va_list values) {
  std::array<char, 300> text;
  std::vsnprintf(text.data(), text.size(), format, values);
  Source& source = *static_cast<Source*>(to);
  if (source.fault.empty() && !is_harmless(text.data())) source.fault = text.data();
  return 1;
}

template <class Source>
tmsize_t read_source(thandle_t from, void* to, tmsize_t count) {
  Source& source = *static_cast<Source*>(from);
  const std::uint64_t held = source.file.size() - std::min(source.at, source.file.size());
  const std::uint64_t bytes = std::min(std::uint64_t(count), held);
  source.is_used_up = source.is_used_up || bytes > source.left;
  if (source.is_used_up) return 0;
  try {
    source.file.read(source.at, to, std::size_t(bytes));
  } catch (const Error& error) {  // no exception may pass through libtiff
    source.fault = error.what();
    return 0;
  }
  source.left -= bytes;
  source.at += bytes;
  return tmsize_t(bytes);
}

tmsize_t write_nothing(thandle_t, void*, tmsize_t) { return 0; }

template <class Source>
toff_t seek_source(thandle_t in, toff_t place, int from) {
  Source& source = *static_cast<Source*>(in);
  return source.at = place + (from == SEEK_CUR ? source.at : from == SEEK_END ? source.file.size() : 0);
}

int close_nothing(thandle_t) { return 0; }

template <class Source>
toff_t size_of_source(thandle_t of) {
  return static_cast<Source*>(of)->file.size();
}

template <class T>
T field(TIFF* tiff, std::uint32_t tag, T missing) {
  T value = missing;
  return TIFFGetFieldDefaulted(tiff, tag, &value) ? value : missing;
}

}  // namespace

TiffPages read_tiff_pages(const InputFile& file) { return Walk(file).all(); }

// libtiff reads from a file that is open already, keeps its messages, and gets no more bytes than a sound file has.

struct TiffReader::Source {
  const InputFile& file;
  std::uint64_t at = 0;
  std::uint64_t left = 4 * file.size() + 65536;  ///< bytes that may still be read: pages that share theirs are refused
  std::string fault{};                           ///< the first message of libtiff
  bool is_used_up = false;
};

TiffReader::TiffReader(const InputFile& file) : source_(new Source{file}) {
  const std::string order = file.text(0, std::size_t(std::min<std::uint64_t>(4, file.size())));
  using namespace std::string_view_literals;
  if (order != "II*\0"sv && order != "MM\0*"sv && order != "II+\0"sv && order != "MM\0+"sv)
    throw Error(file.path().string() + ": is not a TIFF file, or is damaged at its start");
  TIFFOpenOptions* const options = TIFFOpenOptionsAlloc();
  TIFFOpenOptionsSetMaxSingleMemAlloc(options, tmsize_t(file.size() + (16 << 20)));
  TIFFOpenOptionsSetErrorHandlerExtR(options, keep_message<Source>, source_.get());
  TIFFOpenOptionsSetWarningHandlerExtR(options, keep_message<Source>, source_.get());
  tiff_ = TIFFClientOpenExt("", "rm", source_.get(), read_source<Source>, write_nothing, seek_source<Source>,
                            close_nothing, size_of_source<Source>, nullptr, nullptr, options);
  TIFFOpenOptionsFree(options);
  if (!tiff_ && source_->fault.empty()) source_->fault = "its first page is not there";
  check_pages();
  pages_ = 1;
}

TiffReader::~TiffReader() {
  if (tiff_) TIFFClose(tiff_);
}

void TiffReader::check_pages() const {
  const std::string what = source_->file.path().string();
  if (source_->is_used_up)
    throw Error(what + ": its pages lie over each other; it is damaged: copy or export it again");
  if (!source_->fault.empty())
    throw Error(formatted("{}: is cut off or damaged: only {} pages are whole (libtiff: {}); copy or export it again",
                          what, pages_, source_->fault));
}

bool TiffReader::next() {
  const bool is_there = TIFFReadDirectory(tiff_);
  check_pages();
  pages_ += is_there;
  return is_there;
}

TiffPage TiffReader::page() const {
  TiffPage page;
  const auto number = [&](std::uint32_t tag, auto& into) { into = field(tiff_, tag, into); };
  number(TIFFTAG_SUBFILETYPE, page.subfile);
  number(TIFFTAG_IMAGEWIDTH, page.width);
  number(TIFFTAG_IMAGELENGTH, page.height);
  number(TIFFTAG_BITSPERSAMPLE, page.bits);
  number(TIFFTAG_COMPRESSION, page.compression);
  number(TIFFTAG_PHOTOMETRIC, page.photometric);
  number(TIFFTAG_FILLORDER, page.fill_order);
  number(TIFFTAG_ORIENTATION, page.orientation);
  number(TIFFTAG_SAMPLESPERPIXEL, page.samples);
  number(TIFFTAG_ROWSPERSTRIP, page.rows_per_strip);
  number(TIFFTAG_PLANARCONFIG, page.planes);
  number(TIFFTAG_SAMPLEFORMAT, page.format);
  page.is_tiled = TIFFIsTiled(tiff_);
  std::uint16_t *red, *green, *blue;
  if (page.bits <= 8 && TIFFGetField(tiff_, TIFFTAG_COLORMAP, &red, &green, &blue))
    for (std::size_t k = 0; k < 3; ++k) {
      const std::uint16_t* const first = std::array{red, green, blue}[k];
      page.palette[k].assign(first, first + (1 << page.bits));
    }
  return page;
}

std::string TiffReader::description() const {
  const char* text = nullptr;
  return TIFFGetField(tiff_, TIFFTAG_IMAGEDESCRIPTION, &text) && text ? text : "";
}

void TiffReader::read_strips(const TiffPage& page, std::byte* to) {
  const std::size_t row_bytes = page.width * page.samples_together() * (page.bits / 8u);
  for (std::uint32_t strip = 0, row = 0; strip < TIFFNumberOfStrips(tiff_); ++strip) {
    const std::uint32_t rows = std::min(page.rows_per_strip, page.height - row % page.height);
    const tmsize_t bytes = tmsize_t(rows * row_bytes);
    const bool is_whole = TIFFReadEncodedStrip(tiff_, strip, to + row * row_bytes, bytes) == bytes;
    if (source_->is_used_up) check_pages();
    if (!is_whole || !source_->fault.empty())
      throw Error(source_->file.path().string() +
                  ": is cut off or damaged: a strip of its pixels does not hold what its header claims (libtiff: " +
                  source_->fault + "); copy or export it again");
    row += rows;
  }
}

}  // namespace marrow::files
