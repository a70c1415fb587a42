// SPDX-License-Identifier: Apache-2.0
#pragma once
// The values of a DICOM file without its pixels.
#include <Eigen/Core>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "dicom_file.hpp"

namespace marrow::files {

/// The functional group sequences of an enhanced file: for all frames, and for each frame.
constexpr std::uint32_t kSharedGroups = 0x52009229, kFrameGroups = 0x52009230;

/// A data element as the standard lists it.
struct DicomTag {
  std::uint16_t group, element;
  const char* name;
  /// How its values are written: as text, as unsigned or signed numbers of 2 bytes, or as floats of 4 or 8 bytes.
  enum class Kind { text, us, ss, fl, fd } kind = Kind::text;
  std::uint32_t code() const { return std::uint32_t(group) << 16 | element; }
  /// "PixelSpacing (0028,0030)"
  std::string text() const;
};

/// Elements that several readers ask for.
inline constexpr DicomTag kObjectClass{0x0008, 0x0016, "SOPClassUID"};
inline constexpr DicomTag kModality{0x0008, 0x0060, "Modality"};
inline constexpr DicomTag kPrimaryAngle{0x0018, 0x1510, "PositionerPrimaryAngle"};
inline constexpr DicomTag kSecondaryAngle{0x0018, 0x1511, "PositionerSecondaryAngle"};
inline constexpr DicomTag kImagePosition{0x0020, 0x0032, "ImagePositionPatient"};
inline constexpr DicomTag kSamplesPerPixel{0x0028, 0x0002, "SamplesPerPixel", DicomTag::Kind::us};
inline constexpr DicomTag kPhotometric{0x0028, 0x0004, "PhotometricInterpretation"};
inline constexpr DicomTag kRows{0x0028, 0x0010, "Rows", DicomTag::Kind::us};
inline constexpr DicomTag kColumns{0x0028, 0x0011, "Columns", DicomTag::Kind::us};
inline constexpr DicomTag kPixelRepresentation{0x0028, 0x0103, "PixelRepresentation", DicomTag::Kind::us};
inline constexpr DicomTag kPixelSpacing{0x0028, 0x0030, "PixelSpacing"};
inline constexpr DicomTag kIntensity{0x0028, 0x1040, "PixelIntensityRelationship"};
inline constexpr DicomTag kRescaleSlope{0x0028, 0x1053, "RescaleSlope"};

/// The value of an element of text without the blanks and zeros around it.
std::string without_padding(std::string value);

class DicomHeader {
 public:
  /// `frame` counts from 1. It selects the values of an enhanced multi-frame file that are given for each frame.
  DicomHeader(const DicomFile& file, int frame) : file_(file), frame_(frame) {}

  const std::filesystem::path& path() const { return file_.path(); }
  /// The value as text without padding. std::nullopt if the element is missing or empty. Values in the functional
  /// groups of an enhanced file take precedence over values outside of them.
  std::optional<std::string> text(const DicomTag& tag) const;
  /// The values as numbers. Throws Error if they are not numbers, or not `count` of them (0: any number).
  std::optional<std::vector<double>> numbers(const DicomTag& tag, std::size_t count) const;
  std::optional<double> number(const DicomTag& tag) const;
  /// Whether the file has the element and it is not empty.
  bool has(const DicomTag& tag) const { return find(tag) != nullptr; }
  /// The items of a sequence; nullptr if the file does not have it.
  const std::vector<DicomElements>* items(const DicomTag& tag) const {
    const DicomElement* sequence = find(tag);
    return sequence ? &sequence->items : nullptr;
  }

 private:
  const DicomElement* find(const DicomTag& tag) const;
  std::string bytes_of(const DicomElement& element, const DicomTag& tag) const;
  const DicomElement* find_inside(const DicomElements& elements, std::uint32_t tag) const;
  const DicomFile& file_;
  int frame_;
};

inline constexpr DicomTag kPatientOrientation{0x0020, 0x0020, "PatientOrientation"};

/// Which directions of the patient are to the right and down in a stored image: unit vectors in patient coordinates
/// (LPS).
struct PatientOrientation {
  std::string letters;  ///< as the header has them, such as L\F
  Eigen::Vector3d right, down;
};

/// std::nullopt if the header does not give it in letters that are known.
std::optional<PatientOrientation> patient_orientation(const DicomHeader& header);

}  // namespace marrow::files
