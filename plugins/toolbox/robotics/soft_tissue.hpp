// SPDX-License-Identifier: Apache-2.0
#pragma once
// How muscles and bones resist a fragment that is moved. A plain model: the numbers are chosen so that forces are of
// the size that was measured at femoral shafts (Gosling et al., J Orthop Res 23, 2005: 396 N along the shaft).
#include <cmath>

#include "marrow/base/fields.hpp"
#include "marrow/domain/transform.hpp"

namespace marrow::robot {

struct SoftTissue {
  double tone_n = 100;       ///< pull along the shaft at the bone's right length
  double stretch_mm = 15;    ///< each such lengthening multiplies the pull by e
  double side_n_per_mm = 4;  ///< for shifts across the shaft
  double turn_nm_per_deg = 0.15;
  double bone_n_per_mm = 300;  ///< for each mm by which the bones would stick in each other

  using fields = Fields<&SoftTissue::tone_n, &SoftTissue::stretch_mm, &SoftTissue::side_n_per_mm,
                        &SoftTissue::turn_nm_per_deg, &SoftTissue::bone_n_per_mm>;
};

/// When a robot warns, and when it stops.
struct ForceLimits {
  double warn_above_n = 250, warn_above_nm = 5.6, stop_above_n = 400;

  using fields = Fields<&ForceLimits::warn_above_n, &ForceLimits::warn_above_nm, &ForceLimits::stop_above_n>;
};

struct Load {
  double force_n = 0, torque_nm = 0;

  using fields = Fields<&Load::force_n, &Load::torque_nm>;
};

/// The load on a fragment that is displaced from its right place by `displacement` (r [rad], t [mm]) along its own
/// axes, the last of which points to the other fragment, and whose bone sticks in the other's by `overlap_mm`.
inline Load load_of(const SoftTissue& tissue, const Vector6d& displacement, double overlap_mm) {
  const double longer_mm = -displacement[5];
  const double along = tissue.tone_n * std::exp(longer_mm / tissue.stretch_mm) + tissue.bone_n_per_mm * overlap_mm,
               across = tissue.side_n_per_mm * displacement.segment<2>(3).norm();
  return {std::hypot(along, across), tissue.turn_nm_per_deg * degrees(displacement.head<3>().norm())};
}

}  // namespace marrow::robot
