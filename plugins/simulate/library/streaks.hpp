// SPDX-License-Identifier: Apache-2.0
#pragma once
// The artefacts of metal in a CT.

#include "marrow/toolbox/phantom/phantom.hpp"

namespace marrow::phantom {

struct StreakOptions {
  double strength = 1;   ///< factor of all errors
  double blur_mm = 0.5;  ///< of the CT
  double photons = 1e6;  ///< per ray without the patient
  Eigen::Vector2d tissue_centre_mm = Eigen::Vector2d::Zero();
  double tissue_radius_mm = 80;
};

/// Adds the artefacts of metal to a CT, after De Man et al. (IEEE TNS 1999). Each slice is projected along parallel
/// rays. Beam hardening and the few photons behind metal make each line integral wrong; the filtered back-projection of
/// these errors are the streaks. Values are then cut to -1024 to 3071 HU. Without metal in `bodies` nothing changes.
void add_metal_streaks(Volume& volume, const std::vector<const Body*>& bodies, const StreakOptions& options,
                       std::uint64_t seed);

}  // namespace marrow::phantom
