// SPDX-License-Identifier: Apache-2.0
#pragma once
// The fragment that a robot holds, and the load on it.
#include "marrow/robot/contact.hpp"
#include "marrow/toolbox/robotics/robot_state.hpp"

namespace marrow::robot {

class Held {
 public:
  Held(const phantom::Phantom& phantom, const SoftTissue& tissue, const std::string& fragment,
       const std::string& reference, const std::string& what)
      : contact_(phantom, what),
        tissue_(tissue),
        moved_(phantom::fragment_named(phantom, fragment, what)),
        reference_(phantom::fragment_named(phantom, reference, what)) {
    if (moved_.side >= 0 || reference_.side <= 0)
      throw Error(what + ": the robot holds the distal fragment, and the proximal one stays; got '" + fragment +
                  "' and '" + reference + "'");
  }

  const phantom::Fragment& fragment() const { return moved_; }

  Load load_at(const RigidTransform& world_from_ct) const {
    const RigidTransform bone_from_distal =
        inverse(reference_.world_from_bone()) * (world_from_ct * moved_.ct_from_bone);
    return load_of(tissue_, motion_between(reference_.world_from_ct, world_from_ct, moved_.frame),
                   contact_.overlap_mm(bone_from_distal));
  }

 private:
  robot::Contact contact_;
  SoftTissue tissue_;
  const phantom::Fragment& moved_;
  const phantom::Fragment& reference_;
};

}  // namespace marrow::robot
