// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <cstdint>
#include <vector>

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

/// What a search without a start looks at.
struct Seen {
  const Mesh& model;
  const OutlineProjector& projector;
  const List<View>& views;
  const List<EdgeMap>& edges;
};

/// How much all views together speak for a pose: the scores of its whole outline (EdgeScores). Unlike a mean distance,
/// it does not prefer a pose of which little is in view. So poses in different places can be compared.
class Evidence {
 public:
  /// The cells of the coarse maps are `cell_mm` wide at `middle_mm`.
  Evidence(const Seen& seen, const Eigen::Vector3d& middle_mm, double cell_mm);
  double of(const RigidTransform& world_from_model) const;

  /// The poses with the most evidence, at most `count`, the best first.
  std::vector<RigidTransform> best(const std::vector<RigidTransform>& poses, std::size_t count) const;

  /// Moves each pose to one of more evidence, by turns of `step_deg` and shifts of `step_mm` about and along six axes,
  /// twice each. Turns are about the model's middle; if a view does not show that, about the middle of the views. An
  /// outline is drawn once for each round of moves. A move is judged by where it takes these points of the surface; the
  /// evidence of all moves of a round, drawn, decides whether they count.
  void climb(std::vector<RigidTransform>& poses, const Eigen::Vector3d& model_middle_mm, double step_deg,
             double step_mm) const;

 private:
  struct Climber;

  const Seen& seen_;
  const Eigen::Vector3d middle_mm_;
  std::vector<EdgeScores> scores_;
};

}  // namespace marrow::initial
