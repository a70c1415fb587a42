// SPDX-License-Identifier: Apache-2.0
#pragma once
// The elements of a DICOM file. Each length is checked against the rest of the file. No library is used: GDCM reserves
// as much memory as a damaged length claims, and aborts the program at some contradictions; DCMTK takes the first of
// two contradicting elements, and only logs it.
#include <array>
#include <memory>

#include "marrow/toolbox/files/input_file.hpp"

namespace marrow::files {

struct DicomSpan {
  std::uint64_t begin = 0, bytes = 0;
};

struct DicomElement {
  std::uint32_t tag = 0;
  DicomSpan value;
  bool big_endian = false;
  std::array<char, 2> kind{};  ///< its value representation; zeros if the file does not give it (implicit)
  std::vector<std::vector<DicomElement>> items;  ///< of a sequence
};
using DicomElements = std::vector<DicomElement>;

/// Whether the tag is that of a sequence with values that are read: the functional groups of an enhanced file, and the
/// sequences in them. The list is needed because implicit files do not say which elements are sequences.
bool is_group_of_values(std::uint32_t tag);

/// The element with this tag, or nullptr. Throws Error if there are two.
const DicomElement* find_element(const std::filesystem::path& path, const DicomElements& elements, std::uint32_t tag);

class DicomFile {
 public:
  /// `header`: only the elements before the pixels, to tell what the file is, even if its transfer syntax is not
  /// supported. Reading ends where they are damaged, and fault() says why.
  enum class Part { all, header };

  /// Throws Error if the file is not DICOM, has a transfer syntax that is not supported, or has an element that claims
  /// more bytes than the file holds.
  explicit DicomFile(const std::filesystem::path& path, Part part = Part::all);

  const InputFile& file() const { return file_; }
  const std::filesystem::path& path() const { return file_.path(); }
  const std::string& transfer_syntax() const { return transfer_syntax_; }
  /// MediaStorageSOPClassUID: what kind of object the file is. It can be read even if the elements are damaged.
  const std::string& media_class() const { return media_class_; }
  /// Why not all of the header could be read; empty if it could.
  const std::string& fault() const { return fault_; }
  /// The bytes of an element, or of pixels.
  std::string text(const DicomSpan& span) const;
  /// The unpacked content of a deflated file, at the offsets that elements() gives; null for other files.
  const std::shared_ptr<const std::string>& unpacked() const { return unpacked_; }
  bool is_big_endian() const { return big_endian_; }
  const DicomElements& elements() const { return elements_; }
  bool has_pixels() const { return has_pixels_; }
  bool is_compressed() const { return is_compressed_; }
  /// Whether the pixels are written as numbers of 2 bytes (OW), even if a pixel has only one.
  bool pixels_are_words() const { return pixels_are_words_; }
  /// Plain pixels have one part. Compressed pixels have one or more parts after the table of offsets.
  const std::vector<DicomSpan>& pixel_parts() const { return pixel_parts_; }
  const DicomSpan& offset_table() const { return offset_table_; }

 private:
  friend class DicomWalk;
  InputFile file_;
  std::string transfer_syntax_, media_class_, fault_;
  std::shared_ptr<const std::string> unpacked_;
  bool big_endian_ = false, has_pixels_ = false, is_compressed_ = false, pixels_are_words_ = false;
  DicomElements elements_;
  std::vector<DicomSpan> pixel_parts_;
  DicomSpan offset_table_;
};

}  // namespace marrow::files
