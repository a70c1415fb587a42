// SPDX-License-Identifier: Apache-2.0
// The kind of nodes that simulate data. These nodes choose their ports freely.
#include <marrow/plugin.hpp>

MARROW_PLUGIN(plugin) {
  plugin.kind("simulate").summary("simulated data with exact truth").sees_truth().runs_apart(marrow::Apart::computes);
}
