// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <cstdint>
#include <vector>

#include "marrow/domain/camera.hpp"
#include "marrow/domain/features.hpp"
#include "marrow/domain/functions.hpp"

namespace marrow::initial {

/// How much each cell of a coarse image speaks for an outline that passes there in a direction. The scores of a whole
/// outline add up to the logarithm of a likelihood ratio: that its points meet edges as a bone's outline does (19 of
/// 20), against as a random outline does. Cells outside the mask say nothing.
class EdgeScores {
 public:
  static constexpr int kSectors = 16;
  static constexpr int kMost = 127;

  /// `cell_px`: the side of a cell. A point matches an edge up to seven cells away, the less the farther.
  EdgeScores(const View& view, const EdgeMap& edges, double cell_px);

  int columns() const { return columns_; }
  int rows() const { return rows_; }
  double cell_px() const { return cell_px_; }
  /// The sector of an outline's normal.
  static int sector_of(double normal_u, double normal_v);
  /// The score of a point of an outline inside the image.
  int at(double u_px, double v_px, double normal_u, double normal_v) const {
    const int column = int(u_px / cell_px_), row = int(v_px / cell_px_);
    return of(sector_of(normal_u, normal_v))[row * columns_ + column];
  }
  /// The scores of a sector, row by row.
  const std::int8_t* of(int sector) const {
    return scores_.data() + std::size_t(sector) * std::size_t(columns_) * std::size_t(rows_);
  }

 private:
  int columns_, rows_;
  double cell_px_;
  std::vector<std::int8_t> scores_;
};

}  // namespace marrow::initial
