// SPDX-License-Identifier: Apache-2.0
#include <marrow/plugin.hpp>

#include "suite.hpp"

MARROW_PLUGIN(plugin) {
  plugin.kind("shaft")
      .summary("finds the outer borders of the bone's shaft in a view")
      .in<marrow::EdgeMap>("edges", "edge pixels of the view")
      .in<marrow::View>("view", "X-ray view; its camera and its grey values are used")
      .out<marrow::ShaftLines>("lines", "the two outer borders of the shaft, and the rejected pairs")
      .suite(marrow::conformance::shaft_suite());
}
