// SPDX-License-Identifier: Apache-2.0
#pragma once
// What is wrong with a camera, in words: from its numbers alone, and from points that it should show.
#include <optional>
#include <string>
#include <vector>

#include "marrow/domain/camera.hpp"

namespace marrow::calibration {

/// What is known of the device; 0 = not known.
struct Device {
  double source_to_detector_mm = 0, pixel_mm = 0, detector_mm = 0;
};

/// Points in world coordinates and where a view shows them.
struct SeenPoints {
  std::vector<Eigen::Vector3d> world_mm;
  std::vector<Eigen::Vector2d> pixels;
};

/// Sentences about numbers that no X-ray device has: a wrong unit, a camera matrix of another image, a detector smaller
/// than the image says. `object_mm` are points of what should be seen, or none.
std::vector<std::string> implausible_numbers(const Camera& camera, const Device& device,
                                             const std::vector<Eigen::Vector3d>& object_mm);

/// Root mean square of the distances between where points should be seen and where they are. Infinite where one lies
/// behind the source.
double reprojection_error_px(const Camera& camera, const SeenPoints& points);

/// The sentence about the one mistake (mirrored image, flipped axis, wrong unit, pose the other way round ...) that
/// explains the points at least five times better than the camera as it is. None where the camera is right or no single
/// mistake does.
std::optional<std::string> explanation(const Camera& camera, const SeenPoints& points);

/// The pose that the points would have, and how far it is from the camera's; needs six points that are not all in one
/// line.
struct Refit {
  double error_px = 0, turn_deg = 0, shift_mm = 0;
};
std::optional<Refit> refit_pose(const Camera& camera, const SeenPoints& points);

}  // namespace marrow::calibration
