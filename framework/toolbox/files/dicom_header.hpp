// SPDX-License-Identifier: Apache-2.0
#pragma once
// The values of a DICOM file without its pixels.
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "dicom_file.hpp"

namespace marrow::files {

/// Sequences of what an enhanced file says of all frames, and of each.
constexpr std::uint32_t kSharedGroups = 0x52009229, kFrameGroups = 0x52009230;

/// A data element as the standard lists it.
struct DicomTag {
  std::uint16_t group, element;
  const char* name;
  /// How its values are written: as text, as numbers of 2 bytes without or with a sign, or as floating numbers of 4
  /// or 8.
  enum class Kind { text, us, ss, fl, fd } kind = Kind::text;
  std::uint32_t code() const { return std::uint32_t(group) << 16 | element; }
  /// "PixelSpacing (0028,0030)"
  std::string text() const;
};

class DicomHeader {
 public:
  /// `frame` counts from 1 and picks the values that an enhanced multi-frame file gives for each frame.
  DicomHeader(const DicomFile& file, int frame) : file_(file), frame_(frame) {}

  const std::filesystem::path& path() const { return file_.path(); }
  /// The value as text without padding; none where the element is missing or empty. What the functional groups of an
  /// enhanced file say of the frame comes before what stands outside of them.
  std::optional<std::string> text(const DicomTag& tag) const;
  /// The values as numbers. Throws Error where they are none, or where there are not `count` (0: any).
  std::optional<std::vector<double>> numbers(const DicomTag& tag, std::size_t count) const;
  std::optional<double> number(const DicomTag& tag) const;
  /// Whether the file has the element, in whatever form.
  bool has(const DicomTag& tag) const { return find(tag) != nullptr; }

 private:
  const DicomElement* find(const DicomTag& tag) const;
  std::string bytes_of(const DicomElement& element, const DicomTag& tag) const;
  const DicomElement* find_inside(const DicomElements& elements, std::uint32_t tag) const;
  const DicomFile& file_;
  int frame_;
};

}  // namespace marrow::files
