// SPDX-License-Identifier: Apache-2.0
#pragma once
// The geometry of an X-ray image from the header of its DICOM file (XA and RF; PS3.3 C.8.7.5).
#include <filesystem>
#include <optional>
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
  /// Set if higher values mean less radiation: the sum of the lowest and the highest value that the stored bits can
  /// hold, after scaling. A value is inverted by subtracting it from this sum, which is the same for all frames.
  std::optional<double> inverted_from;
};
/// `frame` counts from 1. Throws Error if the values are logarithms, or if the header contradicts itself.
XrayPixels read_xray_pixels(const std::filesystem::path& path, int frame);

}  // namespace marrow::files
