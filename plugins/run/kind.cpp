// SPDX-License-Identifier: Apache-2.0
// The kind of nodes that run programs of others. These nodes choose their ports freely.
#include <marrow/plugin.hpp>

MARROW_PLUGIN(plugin) { plugin.kind("run").summary("runs programs of others as steps of a pipeline"); }
