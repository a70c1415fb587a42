// SPDX-License-Identifier: Apache-2.0
#pragma once
// PatientOrientation: which directions of the patient are to the right and down in a stored image.
#include <Eigen/Core>
#include <optional>
#include <string>

#include "dicom_header.hpp"

namespace marrow::files {

inline constexpr DicomTag kPatientOrientation{0x0020, 0x0020, "PatientOrientation"};

/// Unit vectors in patient coordinates (LPS).
struct PatientOrientation {
  std::string letters;  ///< as the header has them, such as L\F
  Eigen::Vector3d right, down;
};

/// std::nullopt if the header does not give it in letters that are known.
std::optional<PatientOrientation> patient_orientation(const DicomHeader& header);

}  // namespace marrow::files
