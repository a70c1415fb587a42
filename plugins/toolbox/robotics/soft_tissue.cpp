// SPDX-License-Identifier: Apache-2.0
#include "marrow/toolbox/robotics/soft_tissue.hpp"

#include <cmath>

namespace marrow::robot {

Load load_of(const SoftTissue& tissue, const Vector6d& displacement, double overlap_mm) {
  const double longer_mm = -displacement[5];
  const double along = tissue.tone_n * std::exp(longer_mm / tissue.stretch_mm) + tissue.bone_n_per_mm * overlap_mm,
               across = tissue.side_n_per_mm * displacement.segment<2>(3).norm();
  return {std::hypot(along, across), tissue.turn_nm_per_deg * degrees(displacement.head<3>().norm())};
}

}  // namespace marrow::robot
