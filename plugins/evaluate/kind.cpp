// SPDX-License-Identifier: Apache-2.0
// The kind of nodes that judge results. These nodes choose their ports freely.
#include <marrow/plugin.hpp>

MARROW_PLUGIN(plugin) { plugin.kind("evaluate").summary("figures of merit of a result").sees_truth(); }
