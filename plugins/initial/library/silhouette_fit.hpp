// SPDX-License-Identifier: Apache-2.0
#pragma once
// Moves a surface until its silhouette lies on the one that is seen.
#include <vector>

#include "marrow/domain/pose.hpp"
#include "marrow/initial/seen_silhouette.hpp"

namespace marrow::initial {

struct Fitted {
  RigidTransform world_from_model;
  double overlap = 0;  ///< of the drawn and the seen silhouette, the mean over the views; 1: the same
};

/// The mean overlap over the views at a pose.
double mean_overlap(const std::vector<SeenSilhouette>& views, const Mesh& surface,
                    const RigidTransform& world_from_model);

/// Draws the surface, and moves it so that its outer outlines come to lie on the borders of the masks, in all views at
/// once: Gauss-Newton steps on the signed distances, with Huber's weights, about `frame`. Each step draws anew. Several
/// views first shift the surface alone, because the depths that each knows from the size are not exact. The result is
/// the pose of most overlap among the start and all steps.
Fitted fitted(const std::vector<SeenSilhouette>& views, const Mesh& surface, const FragmentFrame& frame,
              const RigidTransform& start, int steps);

}  // namespace marrow::initial
