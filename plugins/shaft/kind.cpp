// SPDX-License-Identifier: Apache-2.0
#include <marrow/plugin.hpp>

MARROW_PLUGIN(plugin) {
  using namespace marrow;
  plugin.kind("shaft")
      .summary("finds the outer borders of the bone's shaft in a view")
      .in<EdgeMap>("edges", "edge pixels of the view")
      .in<View>("view", "X-ray view; its camera and its grey values are used")
      .out<ShaftLines>("lines", "the two outer borders of the shaft, and the rejected pairs");
}
