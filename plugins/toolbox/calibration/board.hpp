// SPDX-License-Identifier: Apache-2.0
#pragma once
// A calibration board with radio-opaque beads on both sides. docs/case.md describes its file.
#include <Eigen/Core>
#include <filesystem>
#include <string>
#include <vector>

namespace marrow::calibration {

/// One bead, with its centre in the board's frame. Landmarks are the larger beads; they serve to find a side in an
/// image.
struct Bead {
  Eigen::Vector3d centre_mm = Eigen::Vector3d::Zero();
  double diameter_mm = 0;
  int side = 0;
  bool landmark = false;
};

struct Board {
  std::vector<std::string> sides;  ///< two names
  std::vector<Bead> beads;

  /// Indices of the beads of a side: all of them, or only the landmarks.
  std::vector<int> of_side(int side, bool landmarks_only = false) const;
  /// Coordinates of these beads in the plane of a side, in mm along two axes from the mean of the side's beads.
  std::vector<Eigen::Vector2d> flat_mm(int side, const std::vector<int>& indices) const;
};

/// Reads a board. Throws Error if the file cannot be read, or if the beads could not be distinguished in an image or do
/// not determine a camera.
Board read_board_file(const std::filesystem::path& path);

}  // namespace marrow::calibration
