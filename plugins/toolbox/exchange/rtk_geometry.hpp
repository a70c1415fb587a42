// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <filesystem>
#include <string>
#include <vector>

#include "marrow/toolbox/exchange/cameras.hpp"

namespace marrow::exchange {

/// A projection of RTK's ThreeDCircularGeometry: distances and offsets in mm, angles in degrees. RTK's world, in mm, is
/// marrow's. The detector's coordinates (u, v), in mm, are those of RTK's images: (0, 0) is where the ray through the
/// isocentre meets a detector without offsets.
struct RtkProjection {
  double source_to_isocentre_mm = 0, source_to_detector_mm = 0;
  double gantry_deg = 0, out_of_plane_deg = 0, in_plane_deg = 0;
  double source_x_mm = 0, source_y_mm = 0, projection_x_mm = 0, projection_y_mm = 0;
};

/// RTK's matrix: (u, v, 1) ~ M (x, 1), with a negative third coordinate in front of the source.
Eigen::Matrix<double, 3, 4> rtk_matrix(const RtkProjection& projection);

/// The projections of a file, in its order. Throws Error with the line for a damaged file, another version, parallel
/// rays, a curved detector, or a matrix that contradicts the angles and distances.
std::vector<RtkProjection> read_rtk(const std::filesystem::path& path);

/// The camera of a projection. Needs the size of the image and of its pixels. RTK counts rows from below, so `mirror`
/// must say how they are turned over. `what` names the projection. Throws Error as camera_of() for a matrix does, or if
/// a size is missing.
Camera camera_of(const RtkProjection& projection, const ImageSize& size, Mirror mirror, const std::string& what);

/// The projection of a camera whose images are turned upside down and centred on the detector. Throws Error if the
/// camera's pixels have another size than `pixel_mm`, or are skewed. `what` names the camera.
RtkProjection projection_of(const Camera& camera, const Eigen::Vector2d& pixel_mm, const std::string& what);

/// A whole file with these cameras, for images that are turned upside down and centred on the detector, as camera_of()
/// takes them with Mirror::upside_down and no `corner_mm`. Throws Error if a camera's pixels have another size than
/// `pixel_mm`, or are skewed.
std::string rtk_geometry(const std::vector<Camera>& cameras, const Eigen::Vector2d& pixel_mm);

}  // namespace marrow::exchange
