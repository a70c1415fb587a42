// SPDX-License-Identifier: Apache-2.0
#pragma once
// The fast way from the seeds to the walls: fronts that race through the bone (fast marching before the level set:
// Malladi and Sethian, A real-time algorithm for medical shape recovery, ICCV 1998). Their speed is g of the chapter's
// Eq 6, but of what lies between two bright things, as that is what a fracture is: dark clefts slow a front, so that
// fronts meet in the cleft and not beyond it. What the front meets outside bone stops it. Who comes first is found by
// Dijkstra's order over neighbouring voxels, which needs no arrival times to be kept; where the surface lies exactly is
// the business of what follows.
#include <cstdint>
#include <vector>

#include "marrow/domain/volume.hpp"

namespace marrow::field {

struct Race {
  double sigma_mm = 0.7;    ///< of the Gaussian that takes the noise away
  double cleft_mm = 3.2;    ///< widest dark cleft that is one (of a wider one the middle is dark by itself)
  double cleft_part = 0.1;  ///< a cleft darker than its walls by this part of them slows a front e times
  double floor_hu = 150;    ///< where the smoothed CT is darker there is no bone
};

/// For each voxel the fragment whose front came first, or kNobody. `seeds`: fractional indices of each
/// fragment.
std::vector<std::uint8_t> race(const marrow::Volume& volume, const std::vector<std::vector<Eigen::Vector3d>>& seeds,
                               const Race& race);

}  // namespace marrow::field
