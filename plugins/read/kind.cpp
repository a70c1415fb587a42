// SPDX-License-Identifier: Apache-2.0
// Nodes that read a file. They choose their ports freely.
#include <marrow/plugin.hpp>

MARROW_PLUGIN(plugin) { plugin.kind("read").summary("value from a file").runs_apart(marrow::Apart::parses); }
