// SPDX-License-Identifier: Apache-2.0
#pragma once
// The tilt of a plate, told from the distortion of the image.
#include <Eigen/Core>
#include <vector>

namespace marrow::distortion {

/// How a tilted plate would look without distortion.
struct PlateTilt {
  std::vector<Eigen::Vector2d> places;  ///< of the dots, in pixels, up to place, turn and size
  double perspective_px = 0;            ///< by which perspective moves what lies half an image from the middle
  double deviation_px = 0;              ///< standard deviation of that

  /// Three deviations or more.
  bool is_certain() const { return perspective_px > 3 * deviation_px; }
};

/// A perspective moves points by a quadratic function of their places, and so does a distortion whose middle is not
/// that of the image. They are told apart by one assumption: the distortion is round. About one middle c it moves a
/// point at z, outwards and around, by a function of its distance: (z - c) (k_1 r^2 + k_2 r^4 + k_3 r^6), where complex
/// numbers are places, r = |z - c|, and the real and imaginary part of k_i are pincushion and S-shape. The middle's
/// prior is that of the image, with a deviation of a tenth of half its side. All is fitted to the dots in use by least
/// squares. The deviation is the larger one of two: that of the fit's normal equations, and the jackknife's over eight
/// sectors of the image, which also sees what is not round.
///
/// `plate`: the dots on the plate, in any unit; `seen_px`: where the image of this size shows them.
PlateTilt tilt_of(const std::vector<Eigen::Vector2d>& plate, const std::vector<Eigen::Vector2d>& seen_px,
                  const std::vector<bool>& is_used, int width_px, int height_px);

}  // namespace marrow::distortion
