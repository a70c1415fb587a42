// SPDX-License-Identifier: Apache-2.0
#pragma once
// A chessboard for the calibration of cameras for visible light.
#include <vector>

#include "marrow/domain/camera.hpp"

namespace marrow::calibration {

/// A chessboard by its inner corners. They are at x = 0, square_mm, ... and y = 0, square_mm, ... in its plane z = 0,
/// and are seen from negative z. The square between (0, 0) and (square_mm, square_mm) is black. One of the two numbers
/// must be even and the other odd, so that the board looks different after half a turn.
struct Chessboard {
  int columns = 9, rows = 6;
  double square_mm = 20;
};

/// Where a chessboard is: the middle of its inner corners, and turns about x, then y, then z of the world.
struct ChessboardPlace {
  Eigen::Vector3d middle_mm = Eigen::Vector3d::Zero();
  Eigen::Vector3d turns_deg{-90, 0, 45};
};

/// Throws Error unless there are at least 3 x 3 corners and the numbers are even and odd.
void check_chessboard(const Chessboard& board, const std::string& what);

/// The inner corners, row by row.
std::vector<Eigen::Vector3d> corners_mm(const Chessboard& board);

/// The middle of the inner corners, in the board's frame.
Eigen::Vector3d middle_of_corners_mm(const Chessboard& board);

RigidTransform world_from_board(const Chessboard& board, const ChessboardPlace& place);

/// The pixels of the inner corners in the order of corners_mm(), to a part of a pixel. Empty if the picture does not
/// show the whole board.
std::vector<Eigen::Vector2d> find_corners(const Picture& picture, const Chessboard& board);

}  // namespace marrow::calibration
