// SPDX-License-Identifier: Apache-2.0
#pragma once
// An X-ray device with distortion that sees a calibration board: the exact truth for tests of calibrations. Nothing
// here is shared with the calibration but the board and the meaning of its parameters.
#include <cstdint>
#include <vector>

#include "marrow/domain/calibration.hpp"
#include "marrow/toolbox/calibration/board.hpp"

namespace marrow::phantom {

struct DeviceOptions {
  int width_px = 1024, height_px = 1024;
  double pixel_mm = 0.3;
  double source_to_detector_mm = 1000;
  Eigen::Vector2d principal_offset_px{7, -5};  ///< of the principal point from the middle of the image
  double pincushion_percent = 7;               ///< how much farther out the middle of an edge is seen
  double pincushion_share_r4 = 0.2;            ///< part of it that grows with the fourth power of the radius
};
/// The exact inner parameters.
Calibration make_device(const DeviceOptions& options);

struct BoardPoses {
  int views = 8;
  double distance_mm = 600;  ///< from the source to the middle of the board
  double tilt_deg = 12;      ///< largest tilt of the board; the views tilt to all sides
  double shift_mm = 4;       ///< largest shift across the beam, along each axis
};
/// Poses of the board drawn from the seed.
std::vector<RigidTransform> draw_board_poses(const calibration::Board& board, const BoardPoses& poses,
                                             std::uint64_t seed);

/// Where a point of the board is seen in the image as taken.
Eigen::Vector2d image_of(const Calibration& device, const RigidTransform& camera_from_board,
                         const Eigen::Vector3d& board_mm);

struct Exposure {
  double attenuation_per_mm = 0.9;  ///< of the beads: steel at 60 keV
  double photons = 2000;            ///< per pixel in the middle; 0 = no noise
  double blur_px = 1.0;
  double vignetting = 0.25;  ///< how much darker the image's corner is
};
/// An image of 16 bits, bright = air: exact chords through the beads, along the rays that the distortion bends.
Image expose_board(const calibration::Board& board, const Calibration& device, const RigidTransform& camera_from_board,
                   const Exposure& exposure, std::uint64_t seed);

}  // namespace marrow::phantom
