// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <functional>
#include <vector>

#include "marrow/domain/pose.hpp"

namespace marrow::together {

/// What the uncertainty of each bone adds to that of the others. Each pose holds the covariance that it would have if
/// all others were exact. `cost` is that of all poses together. The curvature of this cost says how far a bone gives
/// way if another one moves: with unit deviations, the information of all poses is 1 on the diagonal blocks and the
/// correlation of the curvatures elsewhere. The blocks of its inverse are the covariances of single bones whatever the
/// others do (Laplace's approximation). Poses without a finite covariance stay as they are, and count as exact.
void add_neighbours(std::vector<Pose>& poses, const std::function<double(const std::vector<RigidTransform>&)>& cost);

}  // namespace marrow::together
