// SPDX-License-Identifier: Apache-2.0
// The kind of nodes that correct the predicted deviations of poses.
#include <marrow/plugin.hpp>

MARROW_PLUGIN(plugin) {
  plugin.kind("deviations")
      .summary("the same poses with other predicted deviations")
      .in<marrow::Pose>("stages", "poses of a search, from the start to the final one", marrow::over("stage"))
      .in<marrow::Mesh>("model", "surface of the bone; it gives the axes")
      .in<marrow::OutlineProjector>("projector", "draws the bone's outline")
      .in<marrow::View>("views", "X-ray views", marrow::over("view"))
      .out<marrow::Pose>("pose", "the final pose")
      .out<marrow::Pose>("stages", "all poses of the search", marrow::over("stage"));
}
