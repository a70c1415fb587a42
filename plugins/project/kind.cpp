// SPDX-License-Identifier: Apache-2.0
#include <marrow/plugin.hpp>

#include "suite.hpp"

MARROW_PLUGIN(plugin) {
  plugin.kind("project")
      .summary("draws a model as a view would show it: its outline, or a radiograph (DRR)")
      .in<marrow::Mesh>("model", "surface of the bone")
      .in<marrow::Volume>("volume", "CT")
      .in<marrow::SignedField>("field", "signed field of one fragment; everything else is left out")
      .in<marrow::View>("views", "views for which the model will be drawn", marrow::over("view"))
      .in<marrow::RadiographProjector>("projector", "makes radiographs of the bone")
      .in<marrow::Pose>("others", "poses of other bones, whose radiographs are added", marrow::over("fragment"))
      .in<marrow::RadiographProjector>("other_projectors",
                                       "make radiographs of these bones; the bone's own may be among them",
                                       marrow::over("fragment"))
      .out<marrow::OutlineProjector, marrow::RadiographProjector>("projector",
                                                                  "draws the model for any camera and pose")
      .trait("derivatives", "its radiographs have derivatives")
      .trait("device", "computes on a device that not every machine has, and says which is there")
      .suite(marrow::conformance::project_suite());
}
