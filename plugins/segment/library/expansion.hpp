// SPDX-License-Identifier: Apache-2.0
#pragma once
// Fast expansion from the seeds to the walls of the bone: one front per fragment, all at once (fast marching before the
// level set: Malladi and Sethian, A real-time algorithm for medical shape recovery, ICCV 1998). A front's speed follows
// g of the chapter's Eq 6, but g falls with the depth of a dark cleft between two bright walls, because a fracture
// looks like this. Clefts slow the fronts, so that fronts meet in the cleft and not beyond it. A front stops where
// there is no bone. Dijkstra's algorithm over the six neighbours of each voxel finds the front that arrives first. It
// needs no array of arrival times. Later steps find the exact position of the surface.
#include <cstdint>

#include "marrow/domain/volume.hpp"

namespace marrow::segment {

struct Race {
  double sigma_mm = 0.7;        ///< standard deviation of the Gaussian that removes noise
  double cleft_mm = 3.2;        ///< widest dark gap that counts as a cleft (the middle of a wider gap is dark anyway)
  double cleft_fraction = 0.1;  ///< a cleft darker than its walls by this fraction of their value slows a front e times
  double floor_hu = 150;        ///< there is no bone where the smoothed CT is below this
};

/// For each voxel the fragment whose front arrived first, as an index into `seeds`, or kNobody. `seeds`: for each
/// fragment its points, as fractional indices.
std::vector<std::uint8_t> race(const marrow::Volume& volume, const std::vector<std::vector<Eigen::Vector3d>>& seeds,
                               const Race& race);

}  // namespace marrow::segment
