// SPDX-License-Identifier: Apache-2.0
// Nodes that make surfaces.
#include <marrow/plugin.hpp>

#include "suite.hpp"

MARROW_PLUGIN(plugin) {
  plugin.kind("mesh")
      .summary("closed surface: of a signed field, or made from another one")
      .in<marrow::SignedField>("field", "signed distance, negative inside")
      .in<marrow::Mesh>("mesh", "closed surface to make another one from")
      .out<marrow::Mesh>("mesh", "closed surface, normals outward")
      .suite(marrow::conformance::mesh_suite());
}
