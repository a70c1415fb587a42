// SPDX-License-Identifier: Apache-2.0
#include <marrow/plugin.hpp>

MARROW_PLUGIN(plugin) {
  using namespace marrow;
  plugin.kind("mask")
      .summary("views in which some pixels do not count")
      .in<View>("view", "X-ray view")
      .out<View>("view", "the same view with a mask")
      .trait("keeps_what_it_finds", "only what it looks for counts, instead of all else")
      .runs_apart(Apart::computes);
}
