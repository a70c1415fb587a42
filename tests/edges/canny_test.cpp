// SPDX-License-Identifier: Apache-2.0
#include "plugins/edges/canny.cpp"

#include <numeric>

static marrow::EdgeMap find_edges(const marrow::View& view) { return canny(view, Options{}); }

#include "edges/checks.hpp"

namespace {

TEST(Canny, RefusesThresholdsInTheWrongOrder) {
  Options options;
  options.low = 9;
  const auto view = drawn(64, [](double u, double) { return u < 30 ? 500.0 : 900.0; });
  EXPECT_EQ(error_of([&] { canny(view, options); }), "the lower threshold 9.000000 is above the upper one 5.000000");
}

}  // namespace
