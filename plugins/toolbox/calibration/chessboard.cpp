// SPDX-License-Identifier: Apache-2.0
#include "marrow/toolbox/calibration/chessboard.hpp"

#include <algorithm>
#include <opencv2/calib3d.hpp>
#include <opencv2/imgproc.hpp>

#include "marrow/base/error.hpp"
#include "marrow/base/number_text.hpp"

namespace marrow::calibration {
namespace {

/// Brightness in the middle of the square next to the first corner, and of its right neighbour.
bool first_square_is_black(const cv::Mat1b& grey, const std::vector<cv::Point2f>& corners, int columns) {
  const auto middle = [&](int column) {
    const auto at = [&](int c, int r) { return corners[std::size_t(r * columns + c)]; };
    const cv::Point2f sum = at(column, 0) + at(column + 1, 0) + at(column, 1) + at(column + 1, 1);
    const int u = std::clamp(int(std::lround(sum.x / 4)), 1, grey.cols - 2),
              v = std::clamp(int(std::lround(sum.y / 4)), 1, grey.rows - 2);
    return cv::mean(grey(cv::Rect(u - 1, v - 1, 3, 3)))[0];
  };
  return middle(0) < middle(1);
}

}  // namespace

void check_chessboard(const Chessboard& board, const std::string& what) {
  const std::string size = formatted("{} x {}", board.columns, board.rows);
  if (board.columns < 3 || board.rows < 3)
    throw Error(what + ": a chessboard with " + size + " inner corners is too small; give at least 3 x 3");
  if ((board.columns + board.rows) % 2 == 0)
    throw Error(what + ": a chessboard with " + size +
                " inner corners looks the same after half a turn; give an even and an odd number");
}

std::vector<Eigen::Vector3d> corners_mm(const Chessboard& board) {
  std::vector<Eigen::Vector3d> corners;
  for (int row = 0; row < board.rows; ++row)
    for (int column = 0; column < board.columns; ++column)
      corners.emplace_back(column * board.square_mm, row * board.square_mm, 0);
  return corners;
}

Eigen::Vector3d middle_of_corners_mm(const Chessboard& board) {
  return {0.5 * (board.columns - 1) * board.square_mm, 0.5 * (board.rows - 1) * board.square_mm, 0};
}

RigidTransform world_from_board(const Chessboard& board, const ChessboardPlace& place) {
  const auto about = [&](int axis) {
    return Eigen::AngleAxisd(radians(place.turns_deg[axis]), Eigen::Vector3d::Unit(axis));
  };
  RigidTransform transform{"world", "board", (about(2) * about(1) * about(0)).toRotationMatrix(),
                           Eigen::Vector3d::Zero()};
  transform.translation_mm = place.middle_mm - transform.rotation * middle_of_corners_mm(board);
  return transform;
}

std::vector<Eigen::Vector2d> find_corners(const Picture& picture, const Chessboard& board) {
  constexpr int kHalfWindow_px = 5;
  cv::Mat1b grey;
  cv::cvtColor(picture.pixels, grey, cv::COLOR_RGB2GRAY);
  std::vector<cv::Point2f> found;
  if (!cv::findChessboardCorners(grey, {board.columns, board.rows}, found,
                                 cv::CALIB_CB_ADAPTIVE_THRESH | cv::CALIB_CB_NORMALIZE_IMAGE))
    return {};
  cv::cornerSubPix(grey, found, {kHalfWindow_px, kHalfWindow_px}, {-1, -1},
                   {cv::TermCriteria::EPS | cv::TermCriteria::COUNT, 50, 0.001});
  if (!first_square_is_black(grey, found, board.columns)) std::reverse(found.begin(), found.end());
  std::vector<Eigen::Vector2d> corners;
  for (const cv::Point2f& corner : found) corners.emplace_back(corner.x, corner.y);
  return corners;
}

}  // namespace marrow::calibration
