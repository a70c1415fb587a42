// SPDX-License-Identifier: Apache-2.0
// Bones cannot be in one place. Where two registered bones intersect, one of the poses is wrong.
#include <algorithm>

#include "judged.hpp"

namespace marrow::verdict {

double intersection_mm(const Judged& judged, const Mesh& mesh, const List<Pose>& others,
                       const List<SignedField>& other_bones) {
  constexpr std::size_t kPoints = 2000;
  const std::vector<Eigen::Vector3d> points_mm = sample_surface(mesh, kPoints);
  double deepest_mm = 0;
  for (std::size_t i = 0; i < others.size(); ++i) {
    const RigidTransform& pose = others[i].world_from_model;
    if (pose.rotation == judged.pose.world_from_model.rotation &&
        pose.translation_mm == judged.pose.world_from_model.translation_mm)
      continue;  // the bone itself
    const SignedField* bone = other_bones.find(others.name(i));
    if (!bone) throw Error("other_bones has no '" + others.name(i) + "'; give it the same fragments as others");
    if (bone->grid.frame != pose.source)
      throw Error("other_bones: '" + others.name(i) + "' is in frame '" + bone->grid.frame + "', but its pose takes '" +
                  pose.source + "'; give the field of the bone that was registered");
    const RigidTransform other_from_model = inverse(pose) * judged.pose.world_from_model;
    for (const Eigen::Vector3d& point : points_mm) {
      const Eigen::Vector3d index = bone->grid.index_from_point(other_from_model * point);
      const Eigen::Vector3d last = Eigen::Vector3i(bone->grid.size.data()).cast<double>().array() - 1;
      if ((index.array() < 0).any() || (index.array() > last.array()).any()) continue;
      deepest_mm = std::max(deepest_mm, -double(sample_trilinear(bone->grid, bone->values_mm, index)));
    }
  }
  return deepest_mm;
}

}  // namespace marrow::verdict
