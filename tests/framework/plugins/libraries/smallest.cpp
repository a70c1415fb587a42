// SPDX-License-Identifier: Apache-2.0
#include <marrow/plugin.hpp>

namespace {
marrow::Metrics nothing() { return {}; }
}  // namespace

MARROW_PLUGIN(plugin) { plugin.node("test.nothing", nothing).summary("Nothing").out("metrics", "none"); }
