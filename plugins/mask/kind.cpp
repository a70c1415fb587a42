// SPDX-License-Identifier: Apache-2.0
#include <marrow/plugin.hpp>

#include "suite.hpp"

MARROW_PLUGIN(plugin) {
  plugin.kind("mask")
      .summary("views in which some pixels do not count")
      .in<marrow::View>("view", "X-ray view")
      .out<marrow::View>("view", "the same view with a mask")
      .trait("keeps_what_it_finds", "only what it looks for counts, instead of all else")
      .runs_apart(marrow::Apart::computes)
      .suite(marrow::conformance::mask_suite());
}
