// SPDX-License-Identifier: Apache-2.0
// Nodes that find the shaft of a bone.
#include <marrow/plugin.hpp>

#include "suite.hpp"

MARROW_PLUGIN(plugin) {
  plugin.kind("shaft")
      .summary("outer borders of the bone's shaft in a view")
      .in<marrow::EdgeMap>("edges", "edge pixels of the view")
      .in<marrow::View>("view", "X-ray view, for its image and camera")
      .out<marrow::ShaftLines>("lines", "the two outer borders of the shaft, and what was turned away")
      .suite(marrow::conformance::shaft_suite());
}
