// SPDX-License-Identifier: Apache-2.0
#pragma once
// Where a phantom's parts are at one moment. A motion is one phantom and a posture for each frame: surfaces take 40 MB,
// a posture less than a kilobyte.

#include "marrow/base/number_text.hpp"
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
inline ClutteredPhantom in_posture(ClutteredPhantom phantom, const Posture* posture) {
  if (!posture) return phantom;
  const auto counts = [](std::size_t fragments, std::size_t bodies) {
    return formatted("{} fragments and {} bodies", fragments, bodies);
  };
  auto& fragments = phantom.phantom.fragments;
  if (posture->world_from_ct.size() != fragments.size() || posture->bodies.size() != phantom.bodies.size())
    throw Error("the posture is that of another phantom: it is for " +
                counts(posture->world_from_ct.size(), posture->bodies.size()) + ", but the phantom has " +
                counts(fragments.size(), phantom.bodies.size()) + "; take both from the same node");
  for (std::size_t i = 0; i < fragments.size(); ++i) fragments[i].world_from_ct = posture->world_from_ct[i];
  std::vector<Body> bodies;
  for (std::size_t i = 0; i < phantom.bodies.size(); ++i) {
    if (!posture->bodies[i]) continue;
    move(phantom.bodies[i], *posture->bodies[i]);
    bodies.push_back(std::move(phantom.bodies[i]));
  }
  phantom.bodies = std::move(bodies);
  return phantom;
}

}  // namespace marrow::phantom

MARROW_VALUE_TYPE(marrow::phantom::Posture, "phantom_posture", 1)
