// SPDX-License-Identifier: Apache-2.0
// Nodes that find a pose for others to start from.
#include <marrow/plugin.hpp>

MARROW_PLUGIN(plugin) {
  plugin.kind("initial")
      .summary("pose to start from")
      .in<marrow::Mesh>("model", "surface of the fragment")
      .in<marrow::ShaftLines>("lines", "outer borders of the shaft", marrow::over("view"))
      .in<marrow::View>("views", "X-ray views, for their cameras", marrow::over("view"))
      .in<marrow::Pose>("start", "nominal placement; none: the CT's coordinates are the world's")
      .in<marrow::Landmarks>("landmarks", "points in the CT and where they were seen or tracked")
      .in<marrow::Cost>("cost", "what a pose costs")
      .in<marrow::Optimizer>("optimizer", "minimiser of the cost")
      .out<marrow::Pose>("pose", "pose to start from, with the fragment's axes");
}
