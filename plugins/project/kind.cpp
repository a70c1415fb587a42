// SPDX-License-Identifier: Apache-2.0
// Nodes that draw a model.
#include <marrow/plugin.hpp>

#include "suite.hpp"

MARROW_PLUGIN(plugin) {
  plugin.kind("project")
      .summary("draws a model as a view would see it: outline or radiograph")
      .in<marrow::Mesh>("mesh", "surface of the bone")
      .in<marrow::Volume>("volume", "CT")
      .in<marrow::SignedField>("field", "signed field of one fragment, to leave all else out")
      .in<marrow::View>("views", "views that the model will be drawn for", marrow::over("view"))
      .out<marrow::OutlineProjector, marrow::RadiographProjector>("projector",
                                                                  "draws the model for any camera and pose")
      .suite(marrow::conformance::project_suite());
}
