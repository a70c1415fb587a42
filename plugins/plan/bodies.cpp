// SPDX-License-Identifier: Apache-2.0
// What a picture of the plan shows, as surfaces with poses: the bones, the nail, and a rod along each drill's axis.
#include <marrow/plugin.hpp>

#include "marrow/toolbox/geometry/implant.hpp"
#include "marrow/toolbox/geometry/locking_plan.hpp"
#include "marrow/toolbox/phantom/loft.hpp"

namespace {

using namespace marrow;

struct Bodies {
  List<Mesh> meshes;
  List<Pose> poses;
};

Bodies bodies(const List<Mesh>* bones, const List<Pose>* bone_poses, const Mesh& nail, const Pose& pose,
              const geometry::LockingPlan& plan) {
  constexpr double kBeyondMm = 30;
  Bodies result;
  for (std::size_t i = 0; bones && bone_poses && i < bones->size(); ++i)
    if (const Pose* at = bone_poses->find(bones->name(i))) {
      result.meshes.add(bones->name(i), (*bones)[i]);
      result.poses.add(bones->name(i), *at);
    }
  result.meshes.add("nail", nail);
  result.poses.add("nail", pose);
  for (const auto& drill : plan.drills) {
    Mesh rod =
        phantom::tube(drill.guide_mm, drill.centre_mm + kBeyondMm * drill.direction, 0.35 * drill.diameter_mm, 16);
    Pose here;
    here.world_from_model.source = rod.frame;
    result.meshes.add(drill.hole, std::move(rod));
    result.poses.add(drill.hole, here);
  }
  return result;
}

}  // namespace

MARROW_PLUGIN(plugin) {
  plugin.node("plan.bodies", bodies)
      .summary("Bones, nail and drill axes of a locking plan as surfaces with poses, for pictures of it")
      .in("bones", "surfaces of the bones", over("fragment"))
      .in("bone_poses", "their poses", over("fragment"))
      .in("nail", "surface of the nail; simplify a large one first (mesh.simplify)")
      .in("pose", "pose of the nail")
      .in("plan", "plan of plan.locking")
      .out("meshes", &Bodies::meshes, "bones, 'nail', and a rod for each hole, from the drill guide through the hole",
           over("fragment"))
      .out("poses", &Bodies::poses, "their poses", over("fragment"));
}
