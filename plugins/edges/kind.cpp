// SPDX-License-Identifier: Apache-2.0
#include <marrow/plugin.hpp>

MARROW_PLUGIN(plugin) {
  using namespace marrow;
  plugin.kind("edges")
      .summary("edge pixels of an X-ray view")
      .in<View>("view", "X-ray view")
      .out<EdgeMap>("edges", "edge pixels at sub-pixel positions")
      .runs_apart(Apart::computes);
}
