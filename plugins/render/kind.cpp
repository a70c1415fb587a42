// SPDX-License-Identifier: Apache-2.0
// Nodes that draw pictures. They choose their ports freely.
#include <marrow/plugin.hpp>

MARROW_PLUGIN(plugin) { plugin.kind("render").summary("pictures for people").sees_truth(); }
