// SPDX-License-Identifier: Apache-2.0
// The kind of nodes that compute, read or check cameras. These nodes choose their ports freely.
#include <marrow/plugin.hpp>

MARROW_PLUGIN(plugin) {
  plugin.kind("camera").summary("cameras: the geometry of X-ray views").runs_apart(marrow::Apart::computes);
}
