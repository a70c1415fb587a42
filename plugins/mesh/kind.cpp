// SPDX-License-Identifier: Apache-2.0
#include <marrow/plugin.hpp>

#include "suite.hpp"

MARROW_PLUGIN(plugin) {
  plugin.kind("mesh")
      .summary("closed surface, made from a signed field or from another surface")
      .in<marrow::SignedField>("field", "signed distance, negative inside")
      .in<marrow::Mesh>("mesh", "closed surface to change")
      .out<marrow::Mesh>("mesh", "closed surface, normals outward")
      .suite(marrow::conformance::mesh_suite());
}
