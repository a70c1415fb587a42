// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <filesystem>

#include "marrow/domain/calibration.hpp"
#include "marrow/domain/camera.hpp"

namespace marrow::files {

/// A camera from marrow's YAML (.yaml, .yml) or from XMALab's text (any other extension): four blocks "image size",
/// "camera matrix", "rotation" and "translation", numbers by commas; x_camera = R x_world + t in mm, OpenCV's pixel
/// convention; only the YAML can hold a distortion. Throws Error.
DistortedCamera read_camera_file(const std::filesystem::path& path);

}  // namespace marrow::files
