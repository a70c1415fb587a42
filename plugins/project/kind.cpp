// SPDX-License-Identifier: Apache-2.0
#include <marrow/plugin.hpp>

MARROW_PLUGIN(plugin) {
  using namespace marrow;
  plugin.kind("project")
      .summary("draws a model as a view would show it: its outline, or a radiograph (DRR)")
      .in<Mesh>("model", "surface of the bone")
      .in<Volume>("volume", "CT")
      .in<SignedField>("field", "signed field of one fragment; everything else is left out")
      .in<View>("views", "views for which the model will be drawn", over("view"))
      .in<RadiographProjector>("projector", "makes radiographs of the bone")
      .in<Pose>("others", "poses of other bones, whose radiographs are added", over("fragment"))
      .in<RadiographProjector>("other_projectors", "make radiographs of these bones; the bone's own may be among them",
                               over("fragment"))
      .out<OutlineProjector, RadiographProjector>("projector", "draws the model for any camera and pose")
      .trait("derivatives", "its radiographs have derivatives")
      .trait("device", "computes on a device that not every machine has, and says which is there");
}
