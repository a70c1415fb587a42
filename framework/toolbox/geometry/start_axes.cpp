// SPDX-License-Identifier: Apache-2.0
#include "marrow/toolbox/geometry/start_axes.hpp"

#include "marrow/toolbox/geometry/targets.hpp"

namespace marrow::geometry {

Pose with_fragment_axes(Pose start, const Mesh* model, const Context& context) {
  if (model) check_model(start.world_from_model, *model);
  if (start.frame.is_anatomical) return start;
  if (model) return in_frame(std::move(start), fragment_frame(*model));
  context.warn(
      "the start has no axes of the bone, and no model gives them: rotations are about the x, y and z axes of '" +
      start.world_from_model.source +
      "', and which direction is the long axis is not known; wire the bone's surface to 'model'");
  return start;
}

}  // namespace marrow::geometry
