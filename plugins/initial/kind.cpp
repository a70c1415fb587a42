// SPDX-License-Identifier: Apache-2.0
#include <marrow/plugin.hpp>

MARROW_PLUGIN(plugin) {
  plugin.kind("initial")
      .summary("pose to start from")
      .in<marrow::Mesh>("model", "surface of the fragment")
      .in<marrow::ShaftLines>("lines", "outer borders of the shaft", marrow::over("view"))
      .in<marrow::View>("views", "X-ray views; only their cameras are used", marrow::over("view"))
      .in<marrow::View>("silhouettes", "X-ray views whose masks are not 0 where the part is seen", marrow::over("view"))
      .in<marrow::Pose>("start", "nominal placement; none: CT coordinates are taken as world coordinates")
      .in<marrow::Landmarks>("landmarks", "points in the CT and where they were marked in views or tracked")
      .in<marrow::Pose>("first", "a start to choose from")
      .in<marrow::Pose>("second", "a start to choose from")
      .in<marrow::Pose>("third", "a start to choose from")
      .in<marrow::Pose>("fourth", "a start to choose from")
      .in<marrow::Cost>("cost", "cost of a pose")
      .in<marrow::Optimizer>("optimizer", "minimiser of the cost")
      .out<marrow::Pose>("pose", "pose to start from, with the fragment's axes");
}
