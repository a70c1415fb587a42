// SPDX-License-Identifier: Apache-2.0
#include <marrow/plugin.hpp>

MARROW_PLUGIN(plugin) {
  plugin.kind("similarity")
      .summary("cost of a pose: how badly it explains the images")
      .in<marrow::OutlineProjector, marrow::RadiographProjector>("projector", "draws the model for any camera and pose")
      .in<marrow::OutlineProjector>("outline", "projector of this fragment's outline, if 'projector' makes radiographs")
      .in<marrow::Mesh>("model", "surface of the bone")
      .in<marrow::Volume>("volume", "CT from which the surface was made")
      .in<marrow::SignedField>("field", "signed distance to the surface")
      .in<marrow::View>("views", "views with their cameras and masks", marrow::over("view"))
      .in<marrow::EdgeMap>("edges", "edge pixels of each view", marrow::over("view"))
      .in<marrow::Cost>("cost", "another cost, to which this one adds something")
      .in<marrow::Pose>("prior", "pose known from elsewhere, with its covariance")
      .in<marrow::Pose>("found", "pose found by 'cost' alone, with its covariance")
      .in<marrow::Pose>("others", "poses of other fragments, which are left out of the comparison",
                        marrow::over("fragment"))
      .in<marrow::OutlineProjector, marrow::RadiographProjector>(
          "other_projectors", "projectors of the other fragments; this fragment's own may be among them",
          marrow::over("fragment"))
      .in<marrow::OutlineProjector>("other_outlines",
                                    "outline projectors of other bodies that are known only as surfaces",
                                    marrow::over("fragment"))
      .in<marrow::Pose>("poses", "poses of all bones, which cannot lie in one another", marrow::over("fragment"))
      .in<marrow::SignedField>("other_bones", "signed fields of these bones; this bone's own may be among them",
                               marrow::over("fragment"))
      .out<marrow::Cost>("cost", "cost of a pose: how badly it explains the images; smaller is better")
      .trait("derivatives", "its costs have derivatives")
      .trait("unmoved_by_gain", "gain and offset of the line integrals do not change its costs");
}
