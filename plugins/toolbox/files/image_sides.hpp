// SPDX-License-Identifier: Apache-2.0
#pragma once
// Left and right in X-ray images: what the header of a DICOM file says about an image that may be mirrored.
#include <filesystem>
#include <string>
#include <vector>

#include "marrow/domain/camera.hpp"

namespace marrow::files {

/// Sentences for the user if it is doubtful that read_image_file() returns the image as it is seen from the source.
/// Either the image was flipped after it was taken, and the header does not say how the patient lies in it. Or the
/// header says how the patient lies in it, but not from where it was taken. Empty for other files and headers. `frame`
/// counts from 1; 0 is taken as 1.
std::vector<std::string> doubts_about_sides(const std::filesystem::path& image, int frame = 0);

/// The same for a camera whose world has the patient's axes, as those of `c_arm`. Then the header's PatientOrientation
/// decides: one sentence if this camera would see the image mirrored, else none.
std::vector<std::string> doubts_about_sides(const std::filesystem::path& image, int frame, const Camera& camera);

}  // namespace marrow::files
