// SPDX-License-Identifier: Apache-2.0
#include "marrow/guide/board_pose.hpp"

#include <cmath>
#include <opencv2/calib3d.hpp>

#include "marrow/base/error.hpp"
#include "marrow/base/number_text.hpp"

namespace marrow::calibration {

BoardPose board_pose(const ViewPoints& points, const Camera& camera) {
  constexpr std::size_t kFewest = 6;
  if (points.pixels.size() < kFewest)
    throw Error(formatted("view '{}' shows {} beads of the target; its pose needs {} or more", points.name,
                          points.pixels.size(), kFewest));
  std::vector<cv::Point3d> board;
  std::vector<cv::Point2d> pixels;
  for (std::size_t i = 0; i < points.pixels.size(); ++i) {
    board.emplace_back(points.board_mm[i].x(), points.board_mm[i].y(), points.board_mm[i].z());
    pixels.emplace_back(points.pixels[i].x(), points.pixels[i].y());
  }
  cv::Matx33d intrinsics;
  for (int row = 0; row < 3; ++row)
    for (int column = 0; column < 3; ++column) intrinsics(row, column) = camera.intrinsics(row, column);
  cv::Vec3d turn, shift;
  if (!cv::solvePnP(board, pixels, intrinsics, cv::noArray(), turn, shift, false, cv::SOLVEPNP_SQPNP))
    throw Error("view '" + points.name +
                "': no pose of the target explains its beads; is it the camera of this image?");
  cv::solvePnPRefineLM(board, pixels, intrinsics, cv::noArray(), turn, shift);
  BoardPose pose;
  pose.camera_from_board.rotation = rotation_from_vector({turn[0], turn[1], turn[2]});
  pose.camera_from_board.translation_mm = {shift[0], shift[1], shift[2]};
  std::vector<cv::Point2d> back;
  cv::projectPoints(board, turn, shift, intrinsics, cv::noArray(), back);
  double squares = 0;
  for (std::size_t i = 0; i < back.size(); ++i) squares += (back[i] - pixels[i]).dot(back[i] - pixels[i]);
  pose.residual_px = std::sqrt(squares / double(back.size()));
  return pose;
}

}  // namespace marrow::calibration
