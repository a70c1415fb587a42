// SPDX-License-Identifier: Apache-2.0
#pragma once
// Edges along straight lines.
#include <marrow/domain/features.hpp>
#include <utility>

namespace marrow::test {

/// Edges along the upright line u, one a row from one row to before another, whose gradients point to the right (1) or
/// to the left (-1).
inline EdgeMap upright_edges(int width_px, int height_px, double u_px, float direction, int from_v, int to_v,
                             float magnitude = 1) {
  EdgeMap map{width_px, height_px, {}};
  for (int v = from_v; v < to_v; ++v) map.pixels.push_back({float(u_px), float(v), direction, 0, magnitude});
  return map;
}
/// Both edges of the same image.
inline EdgeMap together(EdgeMap one, const EdgeMap& other) {
  one.pixels.insert(one.pixels.end(), other.pixels.begin(), other.pixels.end());
  return one;
}

}  // namespace marrow::test
