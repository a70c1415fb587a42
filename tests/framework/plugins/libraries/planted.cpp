// SPDX-License-Identifier: Apache-2.0
// A library that somebody put into the place of another. When it is loaded, it leaves a file, by which a test sees it.
#include <cstdlib>
#include <fstream>

namespace {
[[gnu::constructor]] void leave_a_mark() {
  if (const char* file = std::getenv("MARROW_TEST_MARK")) std::ofstream(file) << "it ran\n";
}
}  // namespace

int base_number() { return 7; }
