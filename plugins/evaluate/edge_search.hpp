// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <algorithm>
#include <cmath>
#include <limits>
#include <marrow/domain/features.hpp>
#include <vector>

namespace marrow::evaluate {

/// Finds the nearest edge pixel whose gradient has nearly a given direction. Edge pixels are sorted into square cells;
/// cells are visited in growing square rings about the point.
class EdgeSearch {
 public:
  explicit EdgeSearch(const EdgeMap& edges)
      : columns_(edges.width_px / kCell + 1),
        rows_(edges.height_px / kCell + 1),
        cells_(std::size_t(columns_) * rows_) {
    for (const EdgePixel& edge : edges.pixels) cells_[index(column(edge.u_px), row(edge.v_px))].push_back(edge);
  }

  /// The nearest edge within `reach_px` whose direction makes an angle with (normal_u, normal_v) of at most
  /// acos(least_cosine); nullptr where there is none. The normal has unit length.
  const EdgePixel* nearest(double u, double v, double normal_u, double normal_v, double reach_px,
                           double least_cosine) const {
    double best = reach_px;
    const EdgePixel* found = nullptr;
    const int centre_column = column(u), centre_row = row(v);
    // The point lies anywhere in its cell, so ring k holds nothing nearer than (k - 1) cells.
    for (int ring = 0; (ring - 1) * kCell <= best && ring <= std::max(columns_, rows_); ++ring)
      for (int y = centre_row - ring; y <= centre_row + ring; ++y) {
        const bool whole_row = y == centre_row - ring || y == centre_row + ring;
        for (int x = centre_column - ring; x <= centre_column + ring; x += whole_row || ring == 0 ? 1 : 2 * ring) {
          if (x < 0 || y < 0 || x >= columns_ || y >= rows_) continue;
          for (const EdgePixel& edge : cells_[index(x, y)]) {
            if (!(edge.direction_u * normal_u + edge.direction_v * normal_v >= least_cosine)) continue;
            const double distance = std::hypot(edge.u_px - u, edge.v_px - v);
            if (!(distance <= best)) continue;
            best = distance;
            found = &edge;
          }
        }
      }
    return found;
  }

 private:
  static constexpr int kCell = 16;
  std::size_t index(int column, int row) const { return std::size_t(row) * columns_ + column; }
  int column(double u) const { return std::clamp(int(u) / kCell, 0, columns_ - 1); }
  int row(double v) const { return std::clamp(int(v) / kCell, 0, rows_ - 1); }

  int columns_, rows_;
  std::vector<std::vector<EdgePixel>> cells_;
};

}  // namespace marrow::evaluate
