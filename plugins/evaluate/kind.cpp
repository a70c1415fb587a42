// SPDX-License-Identifier: Apache-2.0
// Nodes that judge results. They choose their ports freely.
#include <marrow/plugin.hpp>

MARROW_PLUGIN(plugin) { plugin.kind("evaluate").summary("figures of merit of a result").sees_truth(); }
