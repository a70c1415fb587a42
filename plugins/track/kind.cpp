// SPDX-License-Identifier: Apache-2.0
// The kind of nodes that follow a bone from frame to frame. These nodes choose their ports freely.
#include <marrow/plugin.hpp>

MARROW_PLUGIN(plugin) { plugin.kind("track").summary("follows a moving bone through a sequence of images"); }
