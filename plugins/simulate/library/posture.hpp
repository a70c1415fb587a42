// SPDX-License-Identifier: Apache-2.0
#pragma once
// Where a phantom's parts are at one moment. A motion is one phantom and a posture for each frame: surfaces take 40 MB,
// a posture less than a kilobyte.
#include <optional>
#include <vector>

#include "marrow/toolbox/phantom/phantom.hpp"

namespace marrow::phantom {

struct Posture {
  std::vector<RigidTransform> world_from_ct;  ///< of each fragment
  /// How far each body has moved from its place in the phantom, in frame "world". Absent: it is not in the beam.
  std::vector<std::optional<RigidTransform>> bodies;
  using fields = Fields<&Posture::world_from_ct, &Posture::bodies>;
};

/// The phantom in this posture; without one, as it is. Throws Error if the posture has other numbers of fragments or
/// bodies.
ClutteredPhantom in_posture(ClutteredPhantom phantom, const Posture* posture);

}  // namespace marrow::phantom

MARROW_VALUE_TYPE(marrow::phantom::Posture, "phantom_posture", 1)
