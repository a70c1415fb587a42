// SPDX-License-Identifier: Apache-2.0
#pragma once
// How an X-ray image was taken, as the header of its DICOM file says (XA and RF; PS3.3 C.8.7.5).
#include <filesystem>
#include <string>
#include <vector>

#include "marrow/domain/camera.hpp"

namespace marrow::files {

/// Lengths that replace what the header says; 0 = as the header says.
struct XrayOverrides {
  double source_to_detector_mm = 0, source_to_isocentre_mm = 0, pixel_mm = 0;
};

struct XrayGeometry {
  Camera camera;
  std::vector<std::string> warnings;
};

/// The camera of the image as read_image_file() reads it: one that is stored mirrored (as one facing the patient sees
/// it) is mirrored back. The world's origin is the isocentre, its axes are the patient's (LPS). `frame` counts from 1;
/// 0 = there is only one, or all were taken alike. Throws Error that names all that is missing.
XrayGeometry read_xray_geometry(const std::filesystem::path& path, int frame, const XrayOverrides& overrides);

/// What the pixels of a frame (from 1) need to become the image that the camera sees, bright = air.
struct XrayPixels {
  bool mirrored = false;
  bool inverted = false;  ///< higher values stand for less radiation
};
XrayPixels read_xray_pixels(const std::filesystem::path& path, int frame);

}  // namespace marrow::files
