// SPDX-License-Identifier: Apache-2.0
// Takes a measured distortion out of a view.
#include <marrow/plugin.hpp>

#include "marrow/toolbox/distortion/distortion.hpp"

namespace {

using namespace marrow;

View straighten(const View& view, const distortion::Distortion& distortion) {
  View result = view;
  distortion::straighten(result, distortion);
  return result;
}

}  // namespace

MARROW_PLUGIN(plugin) {
  plugin.node("camera.straighten", straighten)
      .summary("Takes a distortion that was measured with a plate out of a view")
      .in("view", "X-ray view, not corrected for distortion")
      .in("distortion", "how its image is bent")
      .out("view",
           "the same view, straightened; its mask is 0 where the distortion was not measured, and where it was 0 "
           "before");
}
