// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <filesystem>

#include "marrow/domain/calibration.hpp"
#include "marrow/domain/camera.hpp"

namespace marrow::files {

/// Reads a camera from marrow's YAML (.yaml, .yml) or from XMALab's text (any other extension). The text has four
/// blocks "image size", "camera matrix", "rotation" and "translation", with numbers separated by commas. x_camera = R
/// x_world + t in mm, in OpenCV's pixel convention. Only the YAML can hold a distortion. Throws Error if the file
/// cannot be read, or for missing or wrong values.
DistortedCamera read_camera_file(const std::filesystem::path& path);

}  // namespace marrow::files
