// SPDX-License-Identifier: Apache-2.0
// What a picture of the plan shows, as surfaces with poses: the bones, the nail, and a rod along each drill's axis.
#include <marrow/plugin.hpp>

#include "marrow/toolbox/geometry/implant.hpp"
#include "marrow/toolbox/phantom/phantom.hpp"

namespace {

using namespace marrow;

struct Bodies {
  List<Mesh> models;
  List<Pose> poses;
};

Bodies bodies(const List<Mesh>* models, const List<Pose>* poses, const Mesh& nail, const Pose& pose,
              const geometry::LockingPlan& plan) {
  constexpr double kBeyondMm = 30;
  Bodies result;
  for (std::size_t i = 0; models && poses && i < models->size(); ++i)
    if (const Pose* at = poses->find(models->name(i))) {
      result.models.add(models->name(i), (*models)[i]);
      result.poses.add(models->name(i), *at);
    }
  result.models.add("nail", nail);
  result.poses.add("nail", pose);
  for (const auto& drill : plan.drills) {
    Mesh rod =
        phantom::tube(drill.guide_mm, drill.centre_mm + kBeyondMm * drill.direction, 0.35 * drill.diameter_mm, 16);
    Pose here;
    here.world_from_model.source = rod.frame;
    result.models.add(drill.hole, std::move(rod));
    result.poses.add(drill.hole, here);
  }
  return result;
}

}  // namespace

MARROW_PLUGIN(plugin) {
  plugin.node("plan.bodies", bodies)
      .summary("Bones, nail and drill axes of a locking plan as surfaces with poses, for pictures of it")
      .in("models", "surfaces of the bones", over("fragment"))
      .in("poses", "their poses", over("fragment"))
      .in("nail", "surface of the nail; simplify a large one first (mesh.simplify)")
      .in("pose", "pose of the nail")
      .in("plan", "plan of plan.locking")
      .out("models", &Bodies::models, "bones, 'nail', and a rod for each hole, from the drill guide through the hole",
           over("fragment"))
      .out("poses", &Bodies::poses, "their poses", over("fragment"));
}
