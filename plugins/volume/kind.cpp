// SPDX-License-Identifier: Apache-2.0
#include <marrow/plugin.hpp>

MARROW_PLUGIN(plugin) {
  using namespace marrow;
  plugin.kind("volume")
      .summary("a volume for later nodes: an improved CT, or an implant's surface filled with metal")
      .in<Volume>("volume", "CT in Hounsfield units")
      .in<Mesh>("mesh", "closed surface")
      .out<Volume>("volume", "the changed CT, on the same grid, or the surface as a volume")
      .trait("removes_metal", "it takes metal such as a screw out of the CT");
}
