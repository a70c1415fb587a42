// SPDX-License-Identifier: Apache-2.0
#include <marrow/plugin.hpp>

MARROW_PLUGIN(plugin) {
  plugin.kind("mask")
      .summary("views in which some pixels do not count")
      .in<marrow::View>("view", "X-ray view")
      .out<marrow::View>("view", "the same view with a mask")
      .runs_apart(marrow::Apart::computes);
}
