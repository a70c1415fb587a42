// SPDX-License-Identifier: Apache-2.0
// Nodes that search for the least value.
#include <marrow/plugin.hpp>

#include "suite.hpp"

MARROW_PLUGIN(plugin) {
  plugin.kind("optimizer")
      .summary("minimises a function of n numbers")
      .out<marrow::Optimizer>("optimizer", "minimiser")
      .trait("needs_start", "finds the minimum near its start only")
      .suite(marrow::conformance::optimizer_suite());
}
