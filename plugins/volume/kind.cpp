// SPDX-License-Identifier: Apache-2.0
#include <marrow/plugin.hpp>

#include "suite.hpp"

MARROW_PLUGIN(plugin) {
  plugin.kind("volume")
      .summary("a volume for later nodes: an improved CT, or an implant's surface filled with metal")
      .in<marrow::Volume>("volume", "CT in Hounsfield units")
      .in<marrow::Mesh>("mesh", "closed surface")
      .out<marrow::Volume>("volume", "the changed CT, on the same grid, or the surface as a volume")
      .trait("removes_metal", "it takes metal such as a screw out of the CT")
      .suite(marrow::conformance::volume_suite());
}
