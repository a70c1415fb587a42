// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <cmath>
#include <cstdint>
#include <marrow/domain/features.hpp>
#include <marrow/domain/functions.hpp>
#include <vector>

namespace marrow::match {

/// For any edge pixel, the nearest outline point with about the same direction, up to a distance. Points are sorted
/// into square cells of this width.
class NearestOutline {
 public:
  /// `reach_px`: the largest distance for find(). `points` must outlive this object.
  NearestOutline(const std::vector<OutlinePoint>& points, int width_px, int height_px, double reach_px)
      : points_(points),
        cell_px_(float(std::max(reach_px, 1.0))),
        columns_(int(float(width_px) / cell_px_) + 1),
        rows_(int(float(height_px) / cell_px_) + 1) {
    first_.assign(std::size_t(columns_) * std::size_t(rows_) + 1, 0);
    std::vector<std::size_t> cells;
    for (const OutlinePoint& p : points_) cells.push_back(cell(column(p.u_px), row(p.v_px)));
    for (const std::size_t c : cells) ++first_[c + 1];
    for (std::size_t i = 1; i < first_.size(); ++i) first_[i] += first_[i - 1];
    order_.resize(points_.size());
    std::vector<std::uint32_t> next(first_.begin(), first_.end() - 1);
    for (std::size_t i = 0; i < cells.size(); ++i) order_[next[cells[i]]++] = std::uint32_t(i);
  }

  /// Index of the nearest point, or -1 if there is none within `reach_px`, which must not exceed that of the
  /// constructor. `least_cosine`: of the angle between the edge's direction and the point's normal. With
  /// `either_polarity`, the direction may also be the opposite one.
  int find(const EdgePixel& edge, double reach_px, float least_cosine, bool either_polarity = false) const {
    int nearest = -1;
    float least = float(reach_px * reach_px);
    const int c = column(edge.u_px), r = row(edge.v_px);
    for (int y = std::max(0, r - 1); y <= std::min(rows_ - 1, r + 1); ++y)
      for (int x = std::max(0, c - 1); x <= std::min(columns_ - 1, c + 1); ++x)
        for (std::uint32_t k = first_[cell(x, y)]; k < first_[cell(x, y) + 1]; ++k) {
          const OutlinePoint& p = points_[order_[k]];
          const float du = edge.u_px - p.u_px, dv = edge.v_px - p.v_px, distance2 = du * du + dv * dv;
          const float cosine = edge.direction_u * p.normal_u + edge.direction_v * p.normal_v;
          if (distance2 >= least || (either_polarity ? std::abs(cosine) : cosine) < least_cosine) continue;
          least = distance2;
          nearest = int(order_[k]);
        }
    return nearest;
  }

 private:
  int column(float u) const { return std::clamp(int(u / cell_px_), 0, columns_ - 1); }
  int row(float v) const { return std::clamp(int(v / cell_px_), 0, rows_ - 1); }
  std::size_t cell(int column, int row) const { return std::size_t(row) * std::size_t(columns_) + std::size_t(column); }

  const std::vector<OutlinePoint>& points_;
  const float cell_px_;
  const int columns_, rows_;
  std::vector<std::uint32_t> first_, order_;
};

}  // namespace marrow::match
