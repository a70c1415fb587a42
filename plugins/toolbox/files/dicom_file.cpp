// SPDX-License-Identifier: Apache-2.0
#include "dicom_file.hpp"

#include <algorithm>

#include "marrow/base/error.hpp"
#include "marrow/base/number_text.hpp"
#include "samples.hpp"

namespace marrow::files {
namespace {

constexpr std::uint32_t kUndefined = 0xFFFFFFFFu;
constexpr std::uint32_t kItem = 0xFFFEE000u, kItemEnd = 0xFFFEE00Du, kSequenceEnd = 0xFFFEE0DDu, kPixels = 0x7FE00010u;
constexpr int kDeepest = 32;
constexpr const char* kDeflated = "1.2.840.10008.1.2.1.99";
constexpr std::uint64_t kMostElements = 1'000'000;

struct Syntax {
  bool is_explicit = true, big_endian = false;
};

struct KnownSyntax {
  const char *uid, *name;
  bool is_read;
};

constexpr KnownSyntax kSyntaxes[] = {{"1.2.840.10008.1.2", "implicit little endian", true},
                                     {"1.2.840.10008.1.2.1", "explicit little endian", true},
                                     {kDeflated, "deflated", true},
                                     {"1.2.840.10008.1.2.2", "explicit big endian", true},
                                     {"1.2.840.10008.1.2.5", "RLE", true},
                                     {"1.2.840.10008.1.2.4.50", "JPEG baseline", true},
                                     {"1.2.840.10008.1.2.4.51", "JPEG extended", true},
                                     {"1.2.840.10008.1.2.4.57", "JPEG lossless", true},
                                     {"1.2.840.10008.1.2.4.70", "JPEG lossless, first order", true},
                                     {"1.2.840.10008.1.2.4.80", "JPEG-LS lossless", true},
                                     {"1.2.840.10008.1.2.4.81", "JPEG-LS near-lossless", true},
                                     {"1.2.840.10008.1.2.4.90", "JPEG 2000 lossless", true},
                                     {"1.2.840.10008.1.2.4.91", "JPEG 2000", true},
                                     {"1.2.840.10008.1.2.4.92", "JPEG 2000 part 2 lossless", false},
                                     {"1.2.840.10008.1.2.4.93", "JPEG 2000 part 2", false},
                                     {"1.2.840.10008.1.2.4.100", "MPEG-2", false},
                                     {"1.2.840.10008.1.2.4.102", "MPEG-4", false},
                                     {"1.2.840.10008.1.2.4.201", "high-throughput JPEG 2000 lossless", false},
                                     {"1.2.840.10008.1.2.4.202", "high-throughput JPEG 2000 lossless", false},
                                     {"1.2.840.10008.1.2.4.203", "high-throughput JPEG 2000", false}};

constexpr std::uint32_t kGroupsOfValues[] = {
    0x52009229,  // SharedFunctionalGroupsSequence
    0x52009230,  // PerFrameFunctionalGroupsSequence
    0x00189401,  // ProjectionPixelCalibrationSequence
    0x00189405,  // PositionerPositionSequence
    0x00189412,  // XAXRFFrameCharacteristicsSequence
    0x00189432,  // FieldOfViewSequence
    0x00189451,  // FrameDetectorParametersSequence
    0x00189462,  // IsocenterReferenceSystemSequence
    0x00189476,  // XRayGeometrySequence
    0x00209113,  // PlanePositionSequence
    0x00209116,  // PlaneOrientationSequence
    0x00209450,  // PatientOrientationInFrameSequence
    0x00283000,  // ModalityLUTSequence
    0x00289422,  // PixelIntensityRelationshipLUTSequence
    0x00289110,  // PixelMeasuresSequence
    0x00289145,  // PixelValueTransformationSequence
    0x00289443,  // FramePixelDataPropertiesSequence
    0x00620002,  // SegmentSequence
    0x0062000A,  // SegmentIdentificationSequence
};

bool is_long(const std::string& kind) {
  static const std::string kLong = "OB OD OF OL OV OW SQ SV UC UN UR UT UV";
  const std::size_t at = kLong.find(kind);
  return at != std::string::npos && at % 3 == 0;
}
bool is_short(const std::string& kind) {
  static const std::string kShort = "AE AS AT CS DA DS DT FD FL IS LO LT PN SH SL SS ST TM UI UL US";
  const std::size_t at = kShort.find(kind);
  return at != std::string::npos && at % 3 == 0;
}
bool is_kind(const std::string& kind) { return is_long(kind) || is_short(kind); }

bool has_mark(FileWindow& window) { return window.holds(128, 4) && window.text(128, 4) == "DICM"; }

/// Whether a file without a start begins with an element: one of the meta data, or one of the first of group 8. If the
/// element has no kind (implicit), its length must be that of such an element.
bool begins_as_elements(FileWindow& window) {
  if (!window.holds(0, 12)) return false;
  const std::string kind = window.text(4, 2);
  const bool is_explicit = is_kind(kind);
  for (const bool big_endian : {false, true}) {
    const std::uint64_t group = window.number(0, 2, big_endian), element = window.number(2, 2, big_endian);
    if (group == 2 && element <= 0x10 && is_explicit && !big_endian) return true;
    if (group == 8 && element <= 0x18 && (is_explicit || (!big_endian && window.number(4, 4, false) <= 64)))
      return true;
  }
  return false;
}

}  // namespace

/// Reads all elements into a DicomFile.
class DicomWalk {
 public:
  explicit DicomWalk(DicomFile& into) : into_(into), window_(into.file_), size_(into.file_.size()) {}

  void all() {
    start();
    check_syntax();
    if (into_.transfer_syntax_ == kDeflated) unpack();
    elements(syntax(), size_, 0, false, into_.elements_);
  }

  void header() {
    is_header_ = true;
    try {
      start();
      if (into_.transfer_syntax_ == kDeflated) unpack();
      elements(syntax(), size_, 0, false, into_.elements_);
    } catch (const Error& error) {
      into_.fault_ = error.what();
    }
  }

 private:
  struct Next {
    std::uint32_t tag = 0, length = 0;
    std::string kind;  ///< its value representation; empty if implicit
  };

  std::string what() const { return into_.path().string(); }
  [[noreturn]] void damaged(const std::string& fault) const {
    throw Error(what() + ": is cut off or damaged: " + fault + "; copy or export it again");
  }

  std::uint32_t number(int width, bool big_endian) {
    if (!window_.holds(at_, std::uint64_t(width))) damaged("it ends in the middle of an element");
    at_ += std::uint64_t(width);
    return std::uint32_t(window_.number(at_ - std::uint64_t(width), width, big_endian));
  }

  /// Reads what comes before the elements. A file without a start does not say how it is written; its first element
  /// shows it.
  void start() {
    const bool has_start = has_mark(window_);
    if (!has_start && !begins_as_elements(window_))
      throw Error(what() + ": is not a DICOM file, or is damaged at its start");
    at_ = has_start ? 132 : 0;
    meta_data();
    std::string& uid = into_.transfer_syntax_;
    if (uid.empty() && !has_start && window_.holds(at_, 8))
      uid = window_.number(at_, 1, false) == 0  ? "1.2.840.10008.1.2.2"
            : is_kind(window_.text(at_ + 4, 2)) ? "1.2.840.10008.1.2.1"
                                                : "1.2.840.10008.1.2";
    into_.big_endian_ = uid == "1.2.840.10008.1.2.2";
  }
  /// Some programs write elements with a kind where the transfer syntax says without, or the reverse. The first element
  /// shows which is true, because its length never looks like a kind.
  Syntax syntax() {
    const bool is_told = window_.holds(at_, 8);
    return {is_told ? is_kind(window_.text(at_ + 4, 2)) : into_.transfer_syntax_ != "1.2.840.10008.1.2",
            into_.big_endian_};
  }

  /// All elements of a deflated file are packed. Of a header no more is unpacked than headers have.
  void unpack() {
    constexpr std::uint64_t kHeader = 4 << 20, kPart = 1 << 20, kFew = 16 << 20, kMostEach = 100;
    constexpr std::uint64_t kMostBehind = 8;  // filling, or the end of a gzip file that some writers leave
    const std::uint64_t most = is_header_ ? kHeader : std::max(kFew, kMostEach * (into_.file_.size() - at_));
    auto all = std::make_shared<std::string>(into_.file_.text(0, std::size_t(at_)));
    const auto stream = bare_unpacked_bytes(into_.file_, at_, into_.file_.size());
    for (std::size_t got = kPart; got == kPart && all->size() - at_ <= most;) {
      const std::size_t before = all->size();
      all->resize(before + kPart);
      got = stream->take(all->data() + before, kPart);
      all->resize(before + got);
    }
    if (!is_header_ && all->size() - at_ > most) damaged("it unpacks to more than 100 times its size");
    if (!is_header_ && stream->bytes_behind() > kMostBehind) damaged("bytes follow the end of its packed elements");
    into_.unpacked_ = all;
    window_ = FileWindow(into_.file_, *all);
    size_ = all->size();
  }

  Next next(const Syntax& syntax) {
    if (++count_ > kMostElements) damaged("it has more than 1000000 elements");
    Next element;
    element.tag = number(2, syntax.big_endian) << 16;
    element.tag |= number(2, syntax.big_endian);
    if (element.tag >> 16 == 0xFFFE || !syntax.is_explicit) {
      element.length = number(4, syntax.big_endian);
      return element;
    }
    if (!window_.holds(at_, 2)) damaged("it ends in the middle of an element");
    element.kind = window_.text(at_, 2);
    at_ += 2;
    if (is_long(element.kind)) {
      number(2, false);
      element.length = number(4, syntax.big_endian);
    } else if (is_short(element.kind)) {
      element.length = number(2, syntax.big_endian);
    } else {
      damaged("an element is of an unknown kind");
    }
    return element;
  }

  void check_fits(const Next& element, std::uint64_t end) const {
    if (element.length <= end - at_) return;
    if (element.tag == kPixels)
      throw Error(formatted("{}: is cut off: {} bytes of pixels expected, got {}; copy or export it again", what(),
                            element.length, end - at_));
    damaged(formatted("an element claims {} bytes where {} are left", element.length, end - at_));
  }

  void meta_data() {
    while (at_ + 8 <= size_ && window_.number(at_, 2, false) == 2) {
      const Next element = next({true, false});
      check_fits(element, size_);
      if (element.tag == 0x00020002 && element.length <= 64) into_.media_class_ = uid_of(element);
      if (element.tag == 0x00020010 && element.length <= 64) into_.transfer_syntax_ = uid_of(element);
      at_ += element.length;
    }
  }

  std::string uid_of(const Next& element) {
    const std::string uid = window_.text(at_, element.length);
    return uid.substr(0, uid.find_last_not_of(std::string(" \0", 2)) + 1);
  }

  void check_syntax() const {
    const std::string& uid = into_.transfer_syntax_;
    const std::string start = what() + ": is written in the transfer syntax " + uid;
    for (const KnownSyntax& known : kSyntaxes) {
      if (uid != known.uid) continue;
      if (known.is_read) return;
      throw Error(start + " (" + known.name +
                  "), which is not read, nor does gdcmconv; export it again without compression (explicit VR little "
                  "endian)");
    }
    if (uid.find_first_not_of("0123456789.") != std::string::npos || uid.empty())
      damaged("it does not say how it is written (TransferSyntaxUID)");
    throw Error(start + " (unknown), which is not read; convert it: gdcmconv --raw IN OUT");
  }

  /// Reads elements up to `end` or, if `delimited`, up to the delimiter of the item that holds them.
  void elements(const Syntax& syntax, std::uint64_t end, int depth, bool delimited, DicomElements& into) {
    if (depth > kDeepest) damaged("its sequences are nested more than 32 deep");
    while (at_ < end) {
      if (depth == 0 && is_filling(end)) return;
      const Next element = next(syntax);
      if (element.tag == kItemEnd && delimited) return;
      if (element.tag >> 16 == 0xFFFE) damaged("an item's end stands where an element should");
      if (is_header_ && element.tag == kPixels && depth == 0) return;
      into.push_back({element.tag, {at_, 0}, syntax.big_endian, {}, {}});
      if (element.kind.size() == 2) into.back().kind = {element.kind[0], element.kind[1]};
      const bool are_pixels = element.tag == kPixels && depth == 0;
      if (are_pixels && into_.has_pixels_) damaged("it has its pixels twice");
      into_.has_pixels_ = into_.has_pixels_ || are_pixels;
      if (are_pixels) into_.pixels_are_words_ = element.kind == "OW";
      if (element.length == kUndefined && (element.tag == kPixels || element.kind == "OB" || element.kind == "OW")) {
        fragments(syntax, end, are_pixels);
      } else if (element.length == kUndefined) {
        items(inside(element, syntax), end, true, depth, into.back());
      } else {
        check_fits(element, end);
        into.back().value.bytes = element.length;
        if (are_pixels) into_.pixel_parts_.push_back(into.back().value);
        if (is_sequence(element))
          items(inside(element, syntax), at_ + element.length, false, depth, into.back());
        else
          at_ += element.length;
      }
    }
    if (delimited) damaged("an item has no end");
  }

  /// Elements without a value representation (implicit) or with an unknown one (UN) are known as sequences only by
  /// their tag.
  static bool is_sequence(const Next& element) {
    return element.kind == "SQ" || ((element.kind.empty() || element.kind == "UN") && is_group_of_values(element.tag));
  }
  /// Inside an element of unknown kind (UN) the syntax is always implicit little endian.
  static Syntax inside(const Next& element, const Syntax& syntax) {
    return element.kind == "UN" ? Syntax{false, false} : syntax;
  }

  /// Whether only zeros follow.
  bool is_filling(std::uint64_t end) {
    if (end - at_ >= 8 && window_.number(at_, 8, false) != 0) return false;
    for (std::uint64_t place = at_; place < end; ++place)
      if (window_.number(place, 1, false) != 0) damaged("it ends in the middle of an element");
    return true;
  }

  void items(const Syntax& syntax, std::uint64_t end, bool delimited, int depth, DicomElement& sequence) {
    while (at_ < end) {
      const Next item = next(syntax);
      if (item.tag == kSequenceEnd) return;
      if (item.tag != kItem) damaged("a sequence holds something that is no item");
      sequence.items.emplace_back();
      if (item.length == kUndefined) {
        elements(syntax, end, depth + 1, true, sequence.items.back());
      } else {
        check_fits(item, end);
        elements(syntax, at_ + item.length, depth + 1, false, sequence.items.back());
      }
    }
    if (delimited) damaged("a sequence has no end");
  }

  /// Compressed pixels: those of the image itself or, inside a sequence, those of an icon, which are passed over.
  void fragments(const Syntax& syntax, std::uint64_t end, bool are_pixels) {
    if (are_pixels) into_.is_compressed_ = true;
    for (bool is_first = true; at_ < end; is_first = false) {
      const Next item = next(syntax);
      if (item.tag == kSequenceEnd) {
        if (is_first) damaged("its compressed pixels have no table of offsets");
        return;
      }
      if (item.tag != kItem) damaged("its compressed pixels are not in items");
      check_fits(item, end);
      if (are_pixels && is_first) into_.offset_table_ = {at_, item.length};
      if (are_pixels && !is_first) into_.pixel_parts_.push_back({at_, item.length});
      at_ += item.length;
    }
    damaged("its compressed pixels have no end");
  }

  DicomFile& into_;
  FileWindow window_;
  std::uint64_t size_, at_ = 0, count_ = 0;
  bool is_header_ = false;
};

bool looks_like_dicom(const std::filesystem::path& path) {
  const InputFile file(path, true);
  FileWindow window(file);
  return has_mark(window) || begins_as_elements(window);
}

DicomFile::DicomFile(const std::filesystem::path& path, Part part) : file_(path) {
  DicomWalk walk(*this);
  part == Part::all ? walk.all() : walk.header();
}

std::string DicomFile::text(const DicomSpan& span) const {
  if (!unpacked_) return file_.text(span.begin, std::size_t(span.bytes));
  return unpacked_->substr(std::size_t(span.begin), std::size_t(span.bytes));
}

bool is_group_of_values(std::uint32_t tag) {
  return std::find(std::begin(kGroupsOfValues), std::end(kGroupsOfValues), tag) != std::end(kGroupsOfValues);
}

const DicomElement* find_element(const std::filesystem::path& path, const DicomElements& elements, std::uint32_t tag) {
  const DicomElement* found = nullptr;
  for (const DicomElement& element : elements) {
    if (element.tag != tag) continue;
    if (found)
      throw Error(formatted("{}: gives the element ({:04x},{:04x}) twice; it is damaged: copy or export it again",
                            path.string(), tag >> 16, tag & 0xFFFF));
    found = &element;
  }
  return found;
}

}  // namespace marrow::files
