// SPDX-License-Identifier: Apache-2.0
#include "contact.hpp"

#include "marrow/toolbox/field/bones_apart.hpp"

namespace marrow::similarity {
std::vector<double> Contact::residuals(const RigidTransform& world_from_model) const {
  std::vector<double> residuals;
  for (const Neighbour& one : neighbours_) {
    const RigidTransform bone_from_model = inverse(one.world_from_bone) * world_from_model;
    residuals.push_back(field::penetration_mm(*surface_mm_, *one.bone, bone_from_model) /
                        options_.penetration_deviation_mm);
    if (one.is_joined)
      residuals.push_back((field::gap_mm(*surface_mm_, *one.bone, bone_from_model) - options_.joint_width_mm) /
                          options_.joint_deviation_mm);
  }
  return residuals;
}

Contact Contact::with_others(const List<RigidTransform>& world_from_others) const {
  Contact contact = *this;
  for (Neighbour& one : contact.neighbours_)
    if (const RigidTransform* pose = world_from_others.find(one.name)) one.world_from_bone = *pose;
  return contact;
}

}  // namespace marrow::similarity
