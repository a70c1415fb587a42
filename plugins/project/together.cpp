// SPDX-License-Identifier: Apache-2.0
// A bone's radiograph together with those of its neighbours, so that a cost explains what overlaps the bone instead of
// leaving it out.

#include "marrow/toolbox/match/bones_together.hpp"
#include "marrow/toolbox/match/inputs.hpp"

namespace {

using marrow::match::BonesTogether;

std::shared_ptr<const marrow::RadiographProjector> together(
    const marrow::RadiographProjector& bone, const marrow::List<marrow::Pose>& poses,
    const marrow::List<marrow::RadiographProjector>& projectors) {
  for (std::size_t i = 0; i < poses.size(); ++i) check_pose(poses[i], "the pose of '" + poses.name(i) + "'");
  const std::vector<marrow::match::Other> placed = marrow::match::others_of(&bone, &poses, &projectors);
  std::vector<BonesTogether::Other> others;
  for (std::size_t i = 0; i < projectors.size(); ++i)
    if (&projectors[i] != &bone)
      others.push_back({projectors.name(i), projectors.shared(i), placed[others.size()].world_from_model});
  return std::make_shared<BonesTogether>(BonesTogether::Projector(std::shared_ptr<void>(), &bone), std::move(others));
}

}  // namespace

MARROW_PLUGIN(plugin) {
  plugin.node("project.together", together)
      .summary(
          "The radiograph of a bone together with those of other bones in known poses: line integrals add, so that a "
          "bone is explained with what overlaps it")
      .trait("derivatives")
      .in("projector", "makes radiographs of the bone itself")
      .in("others", "poses of all bones; that of the bone itself does not count", marrow::over("fragment"))
      .in("other_projectors", "make radiographs of the other bones, and maybe of this one", marrow::over("fragment"))
      .out("projector",
           "draws all bones for any camera and pose of the bone; nothing where the bone itself is out of view");
}
