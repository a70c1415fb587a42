// SPDX-License-Identifier: Apache-2.0
#pragma once
// The geometry of an X-ray image from the header of its DICOM file (XA and RF; PS3.3 C.8.7.5).
#include <filesystem>
#include <string>
#include <vector>

#include "marrow/domain/camera.hpp"

namespace marrow::files {

/// Lengths that replace those of the header; 0: as the header says.
struct XrayOverrides {
  double source_to_detector_mm = 0, source_to_isocentre_mm = 0, pixel_mm = 0;
};

struct XrayGeometry {
  Camera camera;
  std::vector<std::string> warnings;
};

/// The camera of the image that read_image_file() returns. (That function mirrors back an image that was stored as an
/// observer facing the patient sees it.) The world's origin is the isocentre, its axes are the patient's (LPS). `frame`
/// counts from 1; 0: there is only one frame, or all have the same geometry. Throws Error that names all missing
/// values, or if values are impossible or the frame does not exist.
XrayGeometry read_xray_geometry(const std::filesystem::path& path, int frame, const XrayOverrides& overrides);

/// How to turn the stored pixels into the image that the camera sees, with bright = air.
struct XrayPixels {
  bool mirrored = false;
  bool inverted = false;  ///< higher values mean less radiation
};
/// `frame` counts from 1. Throws Error if the values are logarithms, or if the header contradicts itself.
XrayPixels read_xray_pixels(const std::filesystem::path& path, int frame);

}  // namespace marrow::files
