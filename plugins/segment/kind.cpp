// SPDX-License-Identifier: Apache-2.0
#include <marrow/plugin.hpp>

MARROW_PLUGIN(plugin) {
  using namespace marrow;
  plugin.kind("segment")
      .summary("segments the fragments in a CT: a signed distance field for each, negative inside")
      .in<Volume>("volume", "CT in Hounsfield units")
      .in<Seeds>("seeds", "points inside each fragment", over("fragment"))
      .in<Mesh>("template", "closed surface of a whole bone of this kind, in mm; it may lie anywhere")
      .in<Volume>("label", "mask of each fragment: 1 inside, 0 outside", over("fragment"))
      .out<SignedField>("field", "signed distance to the outer surface of each wanted fragment", over("fragment"))
      .runs_apart(Apart::computes);
}
