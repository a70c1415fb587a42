// SPDX-License-Identifier: Apache-2.0
// Nodes that find, read or check cameras. They choose their ports freely.
#include <marrow/plugin.hpp>

#include "suite.hpp"

MARROW_PLUGIN(plugin) {
  plugin.kind("camera")
      .summary("geometry of a view")
      .runs_apart(marrow::Apart::computes)
      .suite(marrow::conformance::camera_suite());
}
