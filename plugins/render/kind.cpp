// SPDX-License-Identifier: Apache-2.0
// The kind of nodes that draw pictures. These nodes choose their ports freely.
#include <marrow/plugin.hpp>

MARROW_PLUGIN(plugin) { plugin.kind("render").summary("pictures to look at").sees_truth(); }
