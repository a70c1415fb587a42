// SPDX-License-Identifier: Apache-2.0
#pragma once
// The slices of a CT: the files of a series, or the frames of an enhanced file.
#include "dicom_pixels.hpp"

namespace marrow::files {

inline constexpr DicomTag kPatient{0x0010, 0x0020, "PatientID"};
inline constexpr DicomTag kStudy{0x0020, 0x000D, "StudyInstanceUID"};
inline constexpr DicomTag kFrameOfReference{0x0020, 0x0052, "FrameOfReferenceUID"};
inline constexpr DicomTag kRescaleType{0x0028, 0x1054, "RescaleType"};

struct DicomSlice {
  std::string modality, patient, study, frame_of_reference;
  std::string unit;  ///< of its values: HU, US (unspecified), or empty if the header does not say
  DicomPixels pixels;
  int number = 1;          ///< of the frame in its file
  int frame = 1;           ///< the same in `pixels`, which may hold only this one
  Samples samples;         ///< without bytes
  double position_mm = 0;  ///< along the normal of the slices
  bool is_placed = false;  ///< the header gives its position and orientation

  const std::filesystem::path& path() const { return pixels.path; }
  /// For messages: its file and, of several, its frame.
  std::string name() const;
};

/// What the header says of the one slice of a file, or of each frame of an enhanced one. Throws Error if the pixels
/// cannot be those of a CT.
std::vector<DicomSlice> read_dicom_slices(const std::filesystem::path& path);

}  // namespace marrow::files
