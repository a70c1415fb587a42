// SPDX-License-Identifier: Apache-2.0
#pragma once
// Explains in words what is wrong with a camera: from its numbers alone, and from points that it should show.
#include <optional>
#include <string>
#include <vector>

#include "marrow/domain/calibration.hpp"

namespace marrow::calibration {

/// What is known about the device; 0: not known.
struct Device {
  double source_to_detector_mm = 0, pixel_mm = 0, detector_mm = 0;
};

/// Points in world coordinates and their pixels in a view, in the same order.
struct SeenPoints {
  std::vector<Eigen::Vector3d> world_mm;
  std::vector<Eigen::Vector2d> pixels;
};

/// Sentences about numbers that no X-ray device has: a wrong unit, a camera matrix of another image, a detector smaller
/// than the image, a source too close to the object or too far. `object_mm`: points of the object that should be seen,
/// in world coordinates; if it is empty, the object is taken to be near the world's origin.
std::vector<std::string> implausible_numbers(const Camera& camera, const Device& device,
                                             const std::vector<Eigen::Vector3d>& object_mm);

/// Root mean square distance between the pixels at which points should be seen and those at which they are seen.
/// Infinite if a point lies behind the source.
double reprojection_error_px(const Camera& camera, const SeenPoints& points);

/// For each view a sentence about the single mistake (mirrored image, flipped axis, wrong unit, inverted pose ...) that
/// explains its points best. Undoing it must reduce the error to a fifth and to less than 2 % of the image's width.
/// std::nullopt if there is no such mistake, the error is below 1 % of the width, or there are fewer than four points.
/// One view alone may not tell whether its image is mirrored or an axis of the points reversed. So a mistake that
/// explains all views counts first. Otherwise a mistake of the points, which all views share, counts only if no other
/// mistake explains the view.
std::vector<std::optional<std::string>> explanations(const std::vector<Camera>& cameras,
                                                     const std::vector<SeenPoints>& points);

/// Result of refit_pose(): the error that remains, and how far the new pose is from the camera's: angle, and
/// displacement of the points' centre.
struct Refit {
  double error_px = 0, turn_deg = 0, shift_mm = 0;
};
/// The pose of a camera with these inner parameters that shows the points best, by SQPnP (Terzakis and Lourakis, ECCV
/// 2020); no start is needed. std::nullopt if there are fewer than four points, or if they do not determine a pose.
std::optional<RigidTransform> pose_of_points(const Camera& camera, const SeenPoints& points);

/// Fits only the pose to the points, from the camera's pose. std::nullopt if there are fewer than six points, if they
/// do not determine a pose, or if no better pose is found.
std::optional<Refit> refit_pose(const Camera& camera, const SeenPoints& points);

/// Views of a board that is never tilted do not determine the focal length, although noise gives it a value. Throws
/// Error if its standard deviation is more than a tenth of it. Returns a warning if it is more than a hundredth, else
/// an empty text. `views` names what the calibration is from, such as "the photographs".
std::string doubtful_focal_length(const Calibration& calibration, const std::string& views);

}  // namespace marrow::calibration
