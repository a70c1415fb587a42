// SPDX-License-Identifier: Apache-2.0
// Nodes that make data up. They choose their ports freely.
#include <marrow/plugin.hpp>

MARROW_PLUGIN(plugin) { plugin.kind("simulate").summary("data with exact truth").runs_apart(marrow::Apart::computes); }
