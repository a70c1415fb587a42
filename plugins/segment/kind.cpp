// SPDX-License-Identifier: Apache-2.0
// Nodes that find bones in a CT.
#include <marrow/plugin.hpp>

#include "suite.hpp"

MARROW_PLUGIN(plugin) {
  plugin.kind("segment")
      .summary("signed distance field per fragment, negative inside")
      .in<marrow::Volume>("volume", "CT in Hounsfield units")
      .in<marrow::Seeds>("seeds", "points inside each fragment", marrow::over("fragment"))
      .in<marrow::Mesh>("template", "closed surface of a whole bone of this kind, in mm, anywhere")
      .out<marrow::SignedField>("field", "signed distance to the outer surface of each wanted fragment",
                                marrow::over("fragment"))
      .suite(marrow::conformance::segment_suite());
}
