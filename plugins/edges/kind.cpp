// SPDX-License-Identifier: Apache-2.0
#include <marrow/plugin.hpp>

#include "suite.hpp"

MARROW_PLUGIN(plugin) {
  plugin.kind("edges")
      .summary("edge pixels of an X-ray view")
      .in<marrow::View>("view", "X-ray view")
      .out<marrow::EdgeMap>("edges", "edge pixels at sub-pixel positions")
      .runs_apart(marrow::Apart::computes)
      .suite(marrow::conformance::edges_suite());
}
