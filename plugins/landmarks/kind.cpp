// SPDX-License-Identifier: Apache-2.0
#include <marrow/plugin.hpp>

MARROW_PLUGIN(plugin) {
  plugin.kind("landmarks")
      .summary("finds named points of a fragment in X-ray views")
      .in<marrow::Landmarks>("points", "the points in CT coordinates; what they say of views is replaced")
      .in<marrow::View>("views", "X-ray views", marrow::over("view"))
      .in<marrow::RadiographProjector>("projector", "makes radiographs of the fragment")
      .in<marrow::Pose>("start", "about where the fragment is")
      .out<marrow::Landmarks>("landmarks", "the same points, and where the views show them")
      .runs_apart(marrow::Apart::computes);
}
