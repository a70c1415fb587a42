// SPDX-License-Identifier: Apache-2.0
#pragma once
// Cameras as other systems give them: a projection matrix, or a source and a detector in the world.
#include <Eigen/Core>
#include <optional>

#include "marrow/domain/camera.hpp"

namespace marrow::files {

using Projection = Eigen::Matrix<double, 3, 4>;

/// A camera whose image is `size_px` large, and whether only the mirrored image has such a camera. Then its camera
/// matrix has a negative first focal length.
struct ProjectionCamera {
  Camera camera;
  bool is_mirrored = false;
};
/// The camera with pixel ~ P (x, 1); any scale, but the third coordinate must be positive in front of the source.
/// Pixels count from the centre of the first one. std::nullopt if P does not project along rays from a source.
std::optional<ProjectionCamera> camera_of_projection(const Projection& pixel_from_world,
                                                     const Eigen::Vector2i& size_px);

/// A source and a flat detector in world coordinates: the centre of the first pixel, and the unit directions in which
/// columns and rows are counted, at right angles to each other.
struct Detector {
  Eigen::Vector3d source_mm, corner_mm, columns, rows;
  Eigen::Vector2d pixel_mm;  ///< width and height of a pixel
};
/// Its projection: the ray from the source through x meets the detector at corner + u columns + v rows. The source must
/// not lie in the detector's plane.
Projection projection_of(const Detector& detector);

}  // namespace marrow::files
