// SPDX-License-Identifier: Apache-2.0
// The kind of nodes that simulate a robot. They see the truth: the robot moves the fragment where it really is.
#include <marrow/plugin.hpp>

MARROW_PLUGIN(plugin) {
  plugin.kind("robot").summary("a simulated robot that holds a fragment and moves it").sees_truth();
}
