// SPDX-License-Identifier: Apache-2.0
#pragma once
// The narrow door to GDCM: the values of a DICOM file without its pixels.
#include <cstdint>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <vector>

namespace marrow::read {

/// A data element as the standard lists it.
struct DicomTag {
  std::uint16_t group, element;
  const char* name;
  /// "PixelSpacing (0028,0030)"
  std::string text() const;
};

class DicomHeader {
 public:
  /// Throws Error when the file is not DICOM or is damaged. `frame` counts from 1 and picks the values that an enhanced
  /// multi-frame file gives for each frame.
  DicomHeader(const std::filesystem::path& path, int frame);
  ~DicomHeader();

  const std::filesystem::path& path() const { return path_; }
  /// The value as text without padding; none where the element is missing or empty. Elements in the functional groups of an
  /// enhanced file are found like those of a plain one.
  std::optional<std::string> text(const DicomTag& tag) const;
  /// The values as numbers. Throws Error where they are none, or where there are not `count`.
  std::optional<std::vector<double>> numbers(const DicomTag& tag, std::size_t count) const;
  std::optional<double> number(const DicomTag& tag) const;

 private:
  struct File;
  std::filesystem::path path_;
  std::unique_ptr<File> file_;
};

}  // namespace marrow::read
