// SPDX-License-Identifier: Apache-2.0
// GDCM reserves as much memory as a damaged length claims, and takes a file whose pixels are cut off. So the elements of a file
// are walked through here first, each length held against what is left.
#include <gdcmTrace.h>

#include <cstring>
#include <fstream>

#include "marrow/domain/error.hpp"
#include "samples.hpp"

namespace marrow::read {
namespace {

constexpr std::uint32_t kUndefined = 0xFFFFFFFFu;
constexpr std::uint32_t kItem = 0xFFFEE000u, kItemEnd = 0xFFFEE00Du, kSequenceEnd = 0xFFFEE0DDu, kPixels = 0x7FE00010u;
constexpr int kDeepest = 32;
constexpr std::uint64_t kMostElements = 4'000'000;

struct Syntax {
  bool is_explicit = true, big_endian = false;
};

struct Element {
  std::uint32_t tag = 0, length = 0;
  std::string kind;  ///< its value representation; empty where implicit
};

class Walk {
 public:
  explicit Walk(const std::filesystem::path& path) : path_(path), stream_(path, std::ios::binary) {
    size_ = std::filesystem::file_size(path);
  }

  void all() {
    if (!is_dicom()) throw Error(path_.string() + ": is not a DICOM file, or is damaged at its start");
    const Syntax syntax = meta_data();
    if (is_deflated_) throw Error(path_.string() + ": is a deflated DICOM file, which is not read; export it uncompressed");
    elements(syntax, size_, 0);
    check_pixel_count();
  }

 private:
  [[noreturn]] void damaged(const std::string& what) const {
    throw Error(path_.string() + ": is cut off or damaged: " + what + "; copy or export it again");
  }

  std::string take(std::uint64_t count) {
    if (count > size_ - at_) damaged("it ends in the middle of an element");
    std::string bytes(count, '\0');
    stream_.seekg(std::streamoff(at_));
    stream_.read(bytes.data(), std::streamsize(count));
    at_ += count;
    return bytes;
  }
  std::uint32_t number(int width, bool big_endian) {
    const std::string bytes = take(std::uint64_t(width));
    std::uint32_t value = 0;
    for (int i = 0; i < width; ++i) value = value << 8 | std::uint8_t(bytes[std::size_t(big_endian ? i : width - 1 - i)]);
    return value;
  }

  bool is_dicom() {
    if (size_ < 132) return false;
    at_ = 128;
    return take(4) == "DICM";
  }

  Element next(const Syntax& syntax) {
    if (++elements_ > kMostElements) damaged("it has more than 4000000 elements");
    Element element;
    element.tag = number(2, syntax.big_endian) << 16;
    element.tag |= number(2, syntax.big_endian);
    if (element.tag >> 16 == 0xFFFE || !syntax.is_explicit) {
      element.length = number(4, syntax.big_endian);
      return element;
    }
    element.kind = take(2);
    static const std::string kLong = "OB OD OF OL OV OW SQ SV UC UN UR UT UV";
    if (const std::size_t at = kLong.find(element.kind); at != std::string::npos && at % 3 == 0) {
      take(2);
      element.length = number(4, syntax.big_endian);
    } else {
      if (!(std::isupper(std::uint8_t(element.kind[0])) && std::isupper(std::uint8_t(element.kind[1]))))
        damaged("an element has no kind of value");
      element.length = number(2, syntax.big_endian);
    }
    return element;
  }

  void check_fits(const Element& element, std::uint64_t end) const {
    if (element.length <= end - at_) return;
    if (element.tag == kPixels)
      throw Error(path_.string() + ": is cut off: " + std::to_string(element.length) + " bytes of pixels expected, got " +
                  std::to_string(end - at_) + "; copy or export it again");
    damaged("an element claims " + std::to_string(element.length) + " bytes where " + std::to_string(end - at_) + " are left");
  }

  Syntax meta_data() {
    std::string name;
    while (at_ + 8 <= size_) {
      const bool is_meta = number(2, false) == 2;
      at_ -= 2;
      if (!is_meta) break;
      const Element element = next({true, false});
      check_fits(element, size_);
      const std::string value = take(element.length);
      if (element.tag == 0x00020010) name = value.substr(0, value.find_last_not_of(std::string(" \0", 2)) + 1);
    }
    is_deflated_ = name == "1.2.840.10008.1.2.1.99";
    return {name != "1.2.840.10008.1.2", name == "1.2.840.10008.1.2.2"};
  }

  /// The elements up to `end` or, where `delimited`, to the delimiter of the item that they are in.
  void elements(const Syntax& syntax, std::uint64_t end, int depth, bool delimited = false) {
    if (depth > kDeepest) damaged("its sequences are nested more than 32 deep");
    while (at_ < end) {
      if (depth == 0 && end - at_ < 8) {
        if (take(end - at_).find_first_not_of('\0') == std::string::npos) return;  // padding
        damaged("it ends in the middle of an element");
      }
      const Element element = next(syntax);
      if (element.tag == 0 && depth == 0) return;
      if (element.tag == kItemEnd && delimited) return;
      if (element.tag >> 16 == 0xFFFE) damaged("an item's end stands where an element should");
      has_pixels_ = has_pixels_ || (element.tag == kPixels && depth == 0);
      if (element.length == kUndefined) {
        items(element.kind == "UN" ? Syntax{false, false} : syntax, end, depth, element.tag == kPixels && depth == 0);
        continue;
      }
      check_fits(element, end);
      if (element.kind == "SQ") {
        items(syntax, at_ + element.length, depth, false);
      } else if (depth == 0) {
        keep(element, syntax);
      } else {
        at_ += element.length;
      }
    }
    if (delimited) damaged("an item has no end");
  }

  /// The items of a sequence, or the fragments of compressed pixels, up to their end.
  void items(const Syntax& syntax, std::uint64_t end, int depth, bool are_fragments) {
    while (at_ < end) {
      const Element item = next(syntax);
      if (item.tag == kSequenceEnd) return;
      if (item.tag != kItem) damaged("a sequence holds something that is no item");
      if (item.length == kUndefined) {
        elements(syntax, end, depth + 1, true);
        continue;
      }
      check_fits(item, end);
      if (are_fragments)
        at_ += item.length;
      else
        elements(syntax, at_ + item.length, depth + 1);
    }
    if (are_fragments) damaged("its compressed pixels have no end");
  }

  /// Notes what tells how many pixels there should be, and passes over the value.
  void keep(const Element& element, const Syntax& syntax) {
    const std::uint64_t after = at_ + element.length;
    double* const place = element.tag == 0x00280002   ? &samples_
                          : element.tag == 0x00280010 ? &rows_
                          : element.tag == 0x00280011 ? &columns_
                          : element.tag == 0x00280100 ? &bits_
                                                      : nullptr;
    if (place && element.length >= 2) *place = number(2, syntax.big_endian);
    if (element.tag == 0x00280008 && element.length <= 12) frames_ = std::max(1.0, std::strtod(take(element.length).c_str(), nullptr));
    if (element.tag == 0x00080016 && element.length <= 64) is_dose_ = take(element.length).starts_with("1.2.840.10008.5.1.4.1.1.481.2");
    if (element.tag == kPixels) pixel_bytes_ = element.length;
    at_ = after;
  }

  void check_pixel_count() const {
    // GDCM would look for the planes of a dose, and stop the program where they are missing.
    if (is_dose_) throw Error(path_.string() + ": holds a dose of radiotherapy; expected a CT slice or an X-ray image");
    if (!has_pixels_) damaged("it has no pixels");
    if (!(rows_ > 0 && columns_ > 0)) damaged("its header does not say how large the image is");
    if (!(samples_ >= 1 && samples_ <= 4)) damaged("its header tells of " + std::to_string(int(samples_)) + " values per pixel");
    if (pixel_bytes_ < 0) return;  // compressed
    // Of colours, a third may be left out (YBR_FULL_422).
    const double expected = rows_ * columns_ * samples_ * frames_ * bits_ / 8 * (samples_ > 1 ? 2.0 / 3 : 1);
    if (expected > double(pixel_bytes_) + 1)
      damaged("its header tells of " + std::to_string(std::int64_t(expected)) + " bytes of pixels, but there are " +
              std::to_string(std::int64_t(pixel_bytes_)));
  }

  std::filesystem::path path_;
  std::ifstream stream_;
  std::uint64_t size_ = 0, at_ = 0, elements_ = 0;
  bool is_deflated_ = false, has_pixels_ = false, is_dose_ = false;
  double rows_ = 0, columns_ = 0, samples_ = 1, bits_ = 16, frames_ = 1, pixel_bytes_ = -1;
};

}  // namespace

void check_dicom_file(const std::filesystem::path& path) {
  // What GDCM finds odd in a file, it prints; what matters is said by an Error.
  gdcm::Trace::DebugOff();
  gdcm::Trace::WarningOff();
  gdcm::Trace::ErrorOff();
  Walk(path).all();
}

}  // namespace marrow::read
