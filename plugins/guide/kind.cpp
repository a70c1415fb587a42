// SPDX-License-Identifier: Apache-2.0
// The kind of nodes that say how a robot should move. They never see the truth, and choose their ports freely.
#include <marrow/plugin.hpp>

MARROW_PLUGIN(plugin) { plugin.kind("guide").summary("tells a robot how to move, from what images show"); }
