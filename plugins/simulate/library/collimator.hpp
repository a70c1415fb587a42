// SPDX-License-Identifier: Apache-2.0
#pragma once
// The blades and the iris that limit the beam.
#include <algorithm>
#include <array>
#include <opencv2/core/mat.hpp>

#include "marrow/domain/random.hpp"
#include "marrow/domain/transform.hpp"

namespace marrow::phantom {

/// The share of the beam that passes at each pixel of a view, with half shadows; empty if `level` is off. `level` is
/// off, mild, usual or bad (docs/simulation.md). The places of the blades depend on the seed and the view's number.
inline cv::Mat1d passed_by_collimator(const cv::Size& size, const std::string& level, std::uint64_t collimator_seed,
                                      std::size_t view) {
  constexpr std::array<double, 3> kCovered{0.03, 0.08, 0.16};  // by each blade at most, of the image's width
  constexpr double kHalfShadowPx = 2;  // focal spot of 0.6 mm, blades at a fourth of the way to the detector
  if (level == "off") return {};
  const bool iris = level == "bad";
  const double covered = kCovered[level == "mild" ? 0 : level == "usual" ? 1 : 2];
  Random random(Random(collimator_seed, view)(), 0);
  const double width = size.width, height = size.height;
  const Eigen::Vector2d middle(0.5 * (width - 1), 0.5 * (height - 1));
  struct Blade {
    Eigen::Vector2d inward;
    double offset;
  };
  std::array<Blade, 4> blades;
  for (std::size_t k = 0; k < blades.size(); ++k) {
    const double angle = 0.5 * kPi * double(k) + radians(4 * (random.uniform() - 0.5));
    const double side = k % 2 == 0 ? width : height;
    blades[k].inward = {-std::cos(angle), -std::sin(angle)};
    blades[k].offset = 0.5 * side - covered * side * (0.3 + 0.7 * random.uniform());
  }
  const double radius = (0.52 - 0.5 * covered) * std::hypot(width, height) * 0.94;
  cv::Mat1d passed(size);
  for (int v = 0; v < size.height; ++v)
    for (int u = 0; u < size.width; ++u) {
      const Eigen::Vector2d from = Eigen::Vector2d(u, v) - middle;
      double inside = iris ? radius - from.norm() : width;
      for (const Blade& blade : blades) inside = std::min(inside, blade.offset + blade.inward.dot(from));
      passed(v, u) = 0.5 * std::erfc(-inside / (kHalfShadowPx * std::sqrt(2.0)));
    }
  return passed;
}

}  // namespace marrow::phantom
