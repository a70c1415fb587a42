// SPDX-License-Identifier: Apache-2.0
#pragma once
// A calibration board with radio-opaque beads on both sides, as its file describes it (docs/case.md).
#include <Eigen/Core>
#include <filesystem>
#include <string>
#include <vector>

namespace marrow::calibration {

/// One bead: its centre in the board's frame. Landmarks are the larger beads by which a side is found in an image.
struct Bead {
  Eigen::Vector3d centre_mm = Eigen::Vector3d::Zero();
  double diameter_mm = 0;
  int side = 0;
  bool landmark = false;
};

struct Board {
  std::vector<std::string> sides;  ///< two names
  std::vector<Bead> beads;

  /// Indices of the beads of a side, all or the landmarks alone.
  std::vector<int> of_side(int side, bool landmarks_only = false) const;
  /// Flat coordinates of the beads of a side, in mm along two axes of its plane.
  std::vector<Eigen::Vector2d> flat_mm(int side, const std::vector<int>& indices) const;
};

/// Reads a board and checks that its beads can be told apart in an image. Throws Error.
Board read_board_file(const std::filesystem::path& path);

}  // namespace marrow::calibration
