// SPDX-License-Identifier: Apache-2.0
#pragma once
// Tests that include a plugin's file want its functions. What it registers is checked when the plugin itself is built
// and described; here that part is skipped, which halves the time that such a test takes to compile.
#include <marrow/plugin.hpp>

namespace marrow::test {

struct NoNode {
  template <class... Any>
  NoNode& summary(Any&&...) {
    return *this;
  }
  template <class... Any>
  NoNode& in(Any&&...) {
    return *this;
  }
  template <class... Any>
  NoNode& out(Any&&...) {
    return *this;
  }
  template <class... Any>
  NoNode& option(Any&&...) {
    return *this;
  }
  template <class... Any>
  NoNode& relation(Any&&...) {
    return *this;
  }
  template <class... Any>
  NoNode& trait(Any&&...) {
    return *this;
  }
  NoNode& random() { return *this; }
};
struct NoPlugin {
  template <class... Any>
  NoNode node(Any&&...) {
    return {};
  }
  template <class T, class... Any>
  void writer(Any&&...) {}
};

}  // namespace marrow::test

#undef MARROW_PLUGIN
#define MARROW_TEST_JOIN(a, b) a##b
#define MARROW_TEST_PLUGIN(plugin, number) \
  [[maybe_unused]] static void MARROW_TEST_JOIN(not_registered_, number)(marrow::test::NoPlugin & plugin)
#define MARROW_PLUGIN(plugin) MARROW_TEST_PLUGIN(plugin, __COUNTER__)
