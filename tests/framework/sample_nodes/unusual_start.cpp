// SPDX-License-Identifier: Apache-2.0
// What its initialiser does is what that of a library does which was linked with -ffast-math, and more.
#include <fenv.h>
#include <locale.h>

#include <marrow/plugin.hpp>
#ifdef __x86_64__
#include <xmmintrin.h>
#endif

namespace {
[[gnu::constructor]] void change() {
#ifdef __x86_64__
  _mm_setcsr(_mm_getcsr() | 0x8040);
#endif
  fesetround(FE_UPWARD);
  setlocale(LC_ALL, "C.UTF-8");
}

marrow::Metrics nothing() { return {}; }
}  // namespace

MARROW_PLUGIN(plugin) { plugin.node("test.unusual", nothing).summary("Nothing").out("metrics", "none"); }
