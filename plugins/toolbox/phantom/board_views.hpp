// SPDX-License-Identifier: Apache-2.0
#pragma once
// Simulates an X-ray device with distortion that sees a calibration board. It gives the exact truth for tests of
// calibrations. It shares only the board and the definition of the parameters with the calibration.
#include <cstdint>
#include <vector>

#include "marrow/toolbox/calibration/board.hpp"

namespace marrow::phantom {

struct DeviceOptions {
  int width_px = 1024, height_px = 1024;
  double pixel_mm = 0.3;
  double source_to_detector_mm = 1000;
  Eigen::Vector2d principal_offset_px{7, -5};  ///< of the principal point from the middle of the image
  double pincushion_percent = 7;               ///< by how much the middle of the left or right border is moved outwards
  double pincushion_share_r4 = 0.2;            ///< part of the pincushion due to the term in r^4
};
/// The exact inner parameters.
Calibration make_device(const DeviceOptions& options);

struct BoardPoses {
  int views = 8;
  double distance_mm = 600;  ///< from the source to the middle of the board
  double tilt_deg = 12;      ///< largest tilt of the board; the views are tilted to different sides
  double shift_mm = 4;       ///< largest shift across the beam, along each axis
};
/// Random poses camera_from_board; the same for the same seed.
std::vector<RigidTransform> draw_board_poses(const calibration::Board& board, const BoardPoses& poses,
                                             std::uint64_t seed);

/// The pixel of a board point in the image as taken, with distortion.
Eigen::Vector2d image_of(const Calibration& device, const RigidTransform& camera_from_board,
                         const Eigen::Vector3d& board_mm);

struct Exposure {
  double attenuation_per_mm = 0.9;  ///< of the beads: steel at 60 keV
  double photons = 2000;            ///< per pixel in the middle; 0 = no noise
  double blur_px = 1.0;
  double vignetting = 0.25;  ///< by which part the image's corner is darker
};
/// An image of 16 bits, bright = air, from exact chords of the beads along the distorted rays. Noise depends only on
/// the seed. Throws Error if the board reaches to the X-ray source.
Image expose_board(const calibration::Board& board, const Calibration& device, const RigidTransform& camera_from_board,
                   const Exposure& exposure, std::uint64_t seed);

}  // namespace marrow::phantom
