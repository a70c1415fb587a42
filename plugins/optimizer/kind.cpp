// SPDX-License-Identifier: Apache-2.0
#include <marrow/plugin.hpp>

MARROW_PLUGIN(plugin) {
  plugin.kind("optimizer")
      .summary("minimises a function of n variables")
      .out<marrow::Optimizer>("optimizer", "minimiser")
      .trait("needs_start", "finds only a minimum near its start");
}
