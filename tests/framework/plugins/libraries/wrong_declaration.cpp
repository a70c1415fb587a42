// SPDX-License-Identifier: Apache-2.0
#include <marrow/plugin.hpp>

namespace {
struct Options {
  double low = 50;
};
marrow::EdgeMap find(const marrow::View&, const Options&) { return {}; }
}  // namespace

MARROW_PLUGIN(plugin) {
  plugin.node("edges.wrong", find)
      .summary("Wrong in two places")
      .trait("fast")
      .trait("fast")
      .in("view", "view")
      .out("edges", "edges")
      .option("low", &Options::low, "threshold", marrow::at_least(60));
}
