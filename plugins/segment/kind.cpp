// SPDX-License-Identifier: Apache-2.0
#include <marrow/plugin.hpp>

#include "suite.hpp"

MARROW_PLUGIN(plugin) {
  plugin.kind("segment")
      .summary("segments the fragments in a CT: a signed distance field for each, negative inside")
      .in<marrow::Volume>("volume", "CT in Hounsfield units")
      .in<marrow::Seeds>("seeds", "points inside each fragment", marrow::over("fragment"))
      .in<marrow::Mesh>("template", "closed surface of a whole bone of this kind, in mm; it may lie anywhere")
      .in<marrow::Volume>("label", "mask of each fragment: 1 inside, 0 outside", marrow::over("fragment"))
      .out<marrow::SignedField>("field", "signed distance to the outer surface of each wanted fragment",
                                marrow::over("fragment"))
      .runs_apart(marrow::Apart::computes)
      .suite(marrow::conformance::segment_suite());
}
