// SPDX-License-Identifier: Apache-2.0
#include <marrow/plugin.hpp>

MARROW_PLUGIN(plugin) {
  plugin.kind("points")
      .summary("places named points on the surface of a fragment")
      .in<marrow::Mesh>("model", "surface of the fragment, in CT coordinates")
      .out<marrow::Landmarks>("points", "the points in CT coordinates; no view shows them yet");
}
