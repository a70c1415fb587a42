// SPDX-License-Identifier: Apache-2.0
#pragma once
// Points whose places in the straight and in the original image are both known.
#include <Eigen/Core>
#include <cstdint>
#include <vector>

#include "marrow/runtime/node/value.hpp"

namespace marrow::distortion {

/// Points of a plate in an image of this size: where the straight image shows each, and where it was seen. `used` is 0
/// for a point that was found to be wrong. All lists have the same length.
struct PlatePoints {
  int width_px = 0, height_px = 0;
  std::vector<Eigen::Vector2d> ideal_px, seen_px;
  std::vector<std::uint8_t> used;

  void add(const Eigen::Vector2d& ideal, const Eigen::Vector2d& seen, bool is_used = true) {
    ideal_px.push_back(ideal);
    seen_px.push_back(seen);
    used.push_back(is_used ? 1 : 0);
  }
  using fields = Fields<&PlatePoints::width_px, &PlatePoints::height_px, &PlatePoints::ideal_px, &PlatePoints::seen_px,
                        &PlatePoints::used>;
};

}  // namespace marrow::distortion

MARROW_VALUE_TYPE(marrow::distortion::PlatePoints, "plate_points", 1)
