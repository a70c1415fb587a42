// SPDX-License-Identifier: Apache-2.0
#pragma once
// The pose of a board in the image of a calibrated camera: the target on a robot's hand.
#include "marrow/domain/camera.hpp"
#include "marrow/toolbox/calibration/calibrate.hpp"

namespace marrow::calibration {

struct BoardPose {
  RigidTransform camera_from_board{"camera", "board"};
  double residual_px = 0;  ///< root mean square of the distances in the image
};

/// The pose with the least sum of squared distances in the image. OpenCV's SQPnP (Terzakis and Lourakis, ECCV 2020)
/// gives the start; Levenberg-Marquardt steps refine it. Throws Error if there are fewer than six points.
BoardPose board_pose(const ViewPoints& points, const Camera& camera);

}  // namespace marrow::calibration
