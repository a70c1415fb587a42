// SPDX-License-Identifier: Apache-2.0
// The kind of nodes that describe how the fragments of a fracture lie relative to each other. These nodes choose their
// ports freely.
#include <marrow/plugin.hpp>

MARROW_PLUGIN(plugin) { plugin.kind("fracture").summary("misalignment and reduction from the poses of two fragments"); }
