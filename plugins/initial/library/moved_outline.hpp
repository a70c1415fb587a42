// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <vector>

#include "marrow/domain/camera.hpp"
#include "marrow/domain/functions.hpp"
#include "marrow/initial/edge_scores.hpp"

namespace marrow::initial {

/// How one view sees the outline of a bone that was drawn at one pose and then moves a little. The points of the
/// surface on that outline move with the bone, so nothing is drawn anew. The true outline wanders on the surface
/// meanwhile, but along the lines of sight: a turn by an angle about the middle of a sphere moves it by 1 - cos(angle)
/// of the radius.
class MovedOutline {
 public:
  /// All of them are referred to, not copied.
  MovedOutline(const OutlineProjector& projector, const Camera& camera, const EdgeScores& scores);

  /// Draws the outline, and eight cells of it around the image, too: from there, points may move into it.
  void draw(const RigidTransform& world_from_model);

  /// The sum of its scores in the image after a motion of the bone in the world.
  int score_after(const RigidTransform& world_from_world) const;

 private:
  /// In camera coordinates.
  struct SurfacePoint {
    Eigen::Vector3f place_mm, normal;
  };

  const OutlineProjector& projector_;
  const Camera& camera_;
  const EdgeScores& scores_;
  std::vector<SurfacePoint> points_;
};

}  // namespace marrow::initial
