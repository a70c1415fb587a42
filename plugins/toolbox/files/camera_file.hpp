// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <filesystem>

#include "marrow/domain/calibration.hpp"
#include "marrow/domain/camera.hpp"
#include "marrow/toolbox/distortion/distortion.hpp"
#include "marrow/toolbox/geometry/camera_deviations.hpp"

namespace marrow::files {

/// A camera as read from its file: the pinhole model, how exactly it is known, and the distortion that is still in its
/// images: the radial one of the base or a measured one, not both.
struct CameraInFile : DistortedCamera {
  distortion::Distortion measured;
  geometry::CameraDeviations deviations{};  ///< how exactly it is known

  bool is_distorted() const { return !distortion.is_none() || !measured.is_none(); }
};

/// Removes the camera's distortion, if there is one, from a view with its image. Throws Error as
/// marrow::remove_distortion() or distortion::straighten() does.
void straighten(View& view, const CameraInFile& camera);
/// The mask of the straight image, as straightened_mask() makes it.
cv::Mat1b straightened_mask(const cv::Mat1b& original, const CameraInFile& camera);
/// The mask of the original image, as original_mask() makes it.
cv::Mat1b original_mask(const cv::Mat1b& straight, const CameraInFile& camera);

/// Reads a camera from marrow's YAML (.yaml, .yml) or from XMALab's text (any other extension). The text has four
/// blocks "image size", "camera matrix", "rotation" and "translation", with numbers separated by commas. x_camera = R
/// x_world + t in mm, in OpenCV's pixel convention. Only the YAML can hold a distortion. Throws Error if the file
/// cannot be read, or for missing or wrong values.
CameraInFile read_camera_file(const std::filesystem::path& path);

}  // namespace marrow::files
