// SPDX-License-Identifier: Apache-2.0
// Nodes that compare a model with images.
#include <marrow/plugin.hpp>

#include "suite.hpp"

MARROW_PLUGIN(plugin) {
  plugin.kind("similarity")
      .summary("how badly a pose explains the images")
      .in<marrow::OutlineProjector, marrow::RadiographProjector>("projector", "draws the model for any camera and pose")
      .in<marrow::OutlineProjector>("outline", "draws this fragment's outline, where 'projector' makes radiographs")
      .in<marrow::Mesh>("mesh", "surface of the bone")
      .in<marrow::Volume>("volume", "CT that the surface was made from")
      .in<marrow::SignedField>("field", "signed distance to the surface")
      .in<marrow::View>("views", "views with their cameras and masks", marrow::over("view"))
      .in<marrow::EdgeMap>("edges", "edge pixels of each view", marrow::over("view"))
      .in<marrow::Pose>("others", "where other fragments are, which are left out", marrow::over("fragment"))
      .in<marrow::OutlineProjector, marrow::RadiographProjector>(
          "other_projectors", "draw the other fragments, and maybe this one", marrow::over("fragment"))
      .in<marrow::OutlineProjector>("other_outlines", "draw other bodies that are known as surfaces only",
                                    marrow::over("fragment"))
      .out<marrow::Cost>("cost", "how badly a pose explains the images; smaller is better")
      .trait("derivatives", "its costs know their derivatives")
      .trait("unmoved_by_gain", "gain and offset of the line integrals do not change its costs")
      .suite(marrow::conformance::similarity_suite());
}
