// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <vector>

#include "marrow/initial/evidence.hpp"
#include "marrow/runtime/node/context.hpp"

namespace marrow::initial {

/// Where a bone may be, the most likely pose first.
struct Scanned {
  std::vector<RigidTransform> poses;
  Eigen::Vector3d middle_mm = Eigen::Vector3d::Zero();  ///< of what all views show
  double cell_mm = 1;                                   ///< width there of the cells in which edges were compared
};

/// The most likely poses of a bone about which nothing is known but that all views show it, the best first. No two of
/// them are neighbours. `rotations` orientations are tried, spread evenly over all that there are (Alexa,
/// Super-Fibonacci Spirals, CVPR 2022). For each, an outline in each view is slid over a coarse map of the edges, which
/// gives its score at all places at once. The score of a place in space is the sum over the views. The outline is drawn
/// once for each orientation, in the middle of what the views show, and is only scaled with the depth.
///
/// A bone longer than the images are wide is tried with several of its points along its longest axis in view.
/// Throws Error if no place is seen by all views. The result is the same at any number of threads.
Scanned free_scan(const Seen& seen, const FragmentFrame& frame, int rotations, std::size_t poses, Context& context);

}  // namespace marrow::initial
