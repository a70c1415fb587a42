// SPDX-License-Identifier: Apache-2.0
// The kind of nodes that plan the next step of an operation. They never see the truth, and choose their ports freely.
#include <marrow/plugin.hpp>

MARROW_PLUGIN(plugin) { plugin.kind("plan").summary("what to do next in the operation, from the poses found"); }
