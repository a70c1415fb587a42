// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <filesystem>
#include <string>

#include "marrow/domain/camera.hpp"
#include "marrow/toolbox/exchange/camera_matrix.hpp"

namespace marrow::exchange {

/// Whether the file begins as a calibration of JointTrack does, with JT_INTCALIB or JTA_INTCALIB. False if there is no
/// such file.
bool is_jointtrack_camera(const std::filesystem::path& path);

/// The camera in a calibration of JointTrack: the distance from the source to the detector, the place of the principal
/// point from the middle of the image (x to the right, y up), and the side of a pixel, all in mm. The source is the
/// world's origin, with OpenCV's axes: x to the right, y down, z away from the source. The file does not hold the
/// image's size. Throws Error with what is expected for a damaged file, and for a biplane calibration.
Camera read_jointtrack_camera(const std::filesystem::path& path, const ImageSize& size);

/// The same file for a camera. Throws Error if its pixels are not square or skewed, because the file cannot say so.
/// Where the camera stands is left out.
std::string jointtrack_camera(const Camera& camera, double pixel_mm);

}  // namespace marrow::exchange
