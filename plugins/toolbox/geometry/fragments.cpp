// SPDX-License-Identifier: Apache-2.0
#include "marrow/toolbox/geometry/fragments.hpp"

#include "marrow/toolbox/geometry/targets.hpp"

namespace marrow::geometry {

Pose about_fragment_axes(Pose pose, const Mesh* model) {
  if (model) check_model(pose.world_from_model, *model);
  if (pose.frame.is_anatomical || !model) return pose;
  return in_frame(std::move(pose), fragment_frame(*model));
}

Pose with_fragment_axes(Pose pose, const Mesh* model, const Context& context) {
  const Pose start = about_fragment_axes(std::move(pose), model);
  if (start.frame.is_anatomical) return start;
  context.warn(
      "the start has no axes of the bone, and no model gives them: rotations are about the x, y and z axes of '" +
      start.world_from_model.source +
      "', and which direction is the long axis is not known; wire the bone's surface to 'model'");
  return start;
}

}  // namespace marrow::geometry
