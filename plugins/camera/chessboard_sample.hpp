// SPDX-License-Identifier: Apache-2.0
#pragma once
// Test data of the suite for cameras: a chessboard without distortion.
#include "marrow/domain/camera.hpp"

namespace marrow::conformance {

/// A board with 9 x 6 inner corners and squares of 20 mm, with 2 x 2 samples per pixel. It is turned as the camera's
/// world is. `middle_mm`: its middle in the camera's frame.
Picture chessboard_picture(const Camera& camera, const Eigen::Vector3d& middle_mm);

}  // namespace marrow::conformance
