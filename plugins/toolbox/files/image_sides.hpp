// SPDX-License-Identifier: Apache-2.0
#pragma once
// Left and right in X-ray images: what the header of a DICOM file says about an image that may be mirrored.
#include <filesystem>
#include <string>
#include <vector>

#include "marrow/domain/camera.hpp"

namespace marrow::files {

/// Sentences for the user where the header gives a reason to doubt that read_image_file() returns the image as it is
/// seen from the source: it was flipped after it was taken, and nothing says how the patient lies in it; or it says how
/// the patient lies in it, but not from where it was taken. Empty for other files and headers. `frame` counts from 1;
/// 0 is taken as 1.
std::vector<std::string> doubts_about_sides(const std::filesystem::path& image, int frame = 0);

/// The same for a camera whose world has the patient's axes, as those of `c_arm`. The header's PatientOrientation then
/// decides: a sentence if this camera does not see the image so but the other way round, and nothing if it does.
std::vector<std::string> doubts_about_sides(const std::filesystem::path& image, int frame, const Camera& camera);

}  // namespace marrow::files
