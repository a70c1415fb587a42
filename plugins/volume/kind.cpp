// SPDX-License-Identifier: Apache-2.0
#include <marrow/plugin.hpp>

MARROW_PLUGIN(plugin) {
  plugin.kind("volume")
      .summary("a CT made better for what follows")
      .in<marrow::Volume>("volume", "CT in Hounsfield units")
      .out<marrow::Volume>("volume", "the changed CT, on the same grid");
}
