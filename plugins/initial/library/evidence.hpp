// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <vector>

#include "marrow/domain/functions.hpp"
#include "marrow/initial/edge_scores.hpp"

namespace marrow::initial {

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
