// SPDX-License-Identifier: Apache-2.0
// Nodes that tell what a fracture's fragments are to each other. They choose their ports freely.
#include <marrow/plugin.hpp>

MARROW_PLUGIN(plugin) { plugin.kind("fracture").summary("misalignment and reduction from the poses of two fragments"); }
