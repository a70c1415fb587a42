// SPDX-License-Identifier: Apache-2.0
#include "chessboard_sample.hpp"

#include <Eigen/Geometry>
#include <Eigen/LU>
#include <cmath>

namespace marrow::conformance {

Picture chessboard_picture(const Camera& camera, const Eigen::Vector3d& middle_mm) {
  constexpr double kSquare_mm = 20;
  const Eigen::Matrix3d& turn = camera.camera_from_world.rotation;
  Eigen::Matrix3d pixel_from_board;
  pixel_from_board << turn.leftCols<2>(), middle_mm - turn * Eigen::Vector3d(80, 50, 0);
  const Eigen::Matrix3d board_from_pixel = (camera.intrinsics * pixel_from_board).inverse();
  cv::Mat pixels(camera.height_px, camera.width_px, CV_8UC3);
  for (int v = 0; v < camera.height_px; ++v)
    for (int u = 0; u < camera.width_px; ++u) {
      int dark = 0;
      for (int k = 0; k < 4; ++k) {
        const Eigen::Vector2d at =
            (board_from_pixel * Eigen::Vector3d(u - 0.25 + 0.5 * (k & 1), v - 0.25 + 0.5 * (k >> 1), 1)).hnormalized() /
            kSquare_mm;
        const int column = int(std::floor(at.x())), row = int(std::floor(at.y()));
        dark += column >= -1 && column <= 8 && row >= -1 && row <= 5 && (column + row) % 2 == 0;
      }
      pixels.at<cv::Vec3b>(v, u) = cv::Vec3b::all(std::uint8_t(230 - 50 * dark));
    }
  return {pixels};
}

}  // namespace marrow::conformance
