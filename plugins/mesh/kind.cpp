// SPDX-License-Identifier: Apache-2.0
#include <marrow/plugin.hpp>

MARROW_PLUGIN(plugin) {
  using namespace marrow;
  plugin.kind("mesh")
      .summary("closed surface, made from a signed field or from another surface")
      .in<SignedField>("field", "signed distance, negative inside")
      .in<Mesh>("mesh", "closed surface to change")
      .out<Mesh>("mesh", "closed surface, normals outward");
}
