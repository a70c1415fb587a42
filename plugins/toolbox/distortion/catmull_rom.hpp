// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <array>

namespace marrow::distortion {

/// Weights of Catmull and Rom's splines of four nodes, at `t` after the second one. They are those of Keys' cubic
/// convolution with a = -1/2 (IEEE Trans. ASSP 1981), which is exact for parabolas. OpenCV's a = -3/4 moves edges by up
/// to 0.05 pixel.
inline std::array<double, 4> catmull_rom(double t) {
  return {t * (-0.5 + t * (1 - 0.5 * t)), 1 + t * t * (-2.5 + 1.5 * t), t * (0.5 + t * (2 - 1.5 * t)),
          t * t * (-0.5 + 0.5 * t)};
}

}  // namespace marrow::distortion
