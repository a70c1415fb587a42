// SPDX-License-Identifier: Apache-2.0
#pragma once
// The board that ships, and views of it whose truth is known.
#include <random>

#include "marrow/toolbox/phantom/board_views.hpp"

namespace marrow::test {

inline const std::filesystem::path kBoardFile =
    std::filesystem::path(MARROW_SOURCE_DIR) / "pipelines/calibration/board.yaml";

inline const calibration::Board& board() {
  static const calibration::Board read = calibration::read_board_file(kBoardFile);
  return read;
}

/// Where the beads of the board are seen in each pose, with normal noise on each coordinate. Beads outside the image
/// are left out.
inline std::vector<calibration::ViewPoints> see_board(const Calibration& device,
                                                      const std::vector<RigidTransform>& poses, double noise_px,
                                                      unsigned seed) {
  std::mt19937_64 random(seed);
  std::normal_distribution<double> normal(0, 1);
  std::vector<calibration::ViewPoints> views;
  for (const auto& pose : poses) {
    calibration::ViewPoints view{"view" + std::to_string(views.size() + 1), {}, {}, {}};
    for (std::size_t i = 0; i < board().beads.size(); ++i) {
      const Eigen::Vector2d at = phantom::image_of(device, pose, board().beads[i].centre_mm);
      const Eigen::Vector2d noise(noise_px * normal(random), noise_px * normal(random));
      if (at.x() < 5 || at.y() < 5 || at.x() > device.width_px - 6 || at.y() > device.height_px - 6) continue;
      view.beads.push_back(int(i));
      view.board_mm.push_back(board().beads[i].centre_mm);
      view.pixels.push_back(at + noise);
    }
    views.push_back(view);
  }
  return views;
}

}  // namespace marrow::test
