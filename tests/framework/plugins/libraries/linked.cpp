// SPDX-License-Identifier: Apache-2.0
// A plugin whose results are made by libraries that it links.
#include <marrow/plugin.hpp>

int base_number();

namespace {
struct Options {};
marrow::Metrics number(const Options&) { return {{{"value", double(base_number()), ""}}}; }
}  // namespace

MARROW_PLUGIN(plugin) {
  plugin.node("test.linked", number).summary("A number of another library").out("number", "the number");
}
