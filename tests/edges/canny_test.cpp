// SPDX-License-Identifier: Apache-2.0
#include "plugins/edges/canny.cpp"

#include <numeric>

static marrow::EdgeMap find_edges(const marrow::View& view) { return canny(view, Options{}); }

#include "edges/checks.hpp"
#include "shipped.hpp"

namespace {

TEST(Canny, DeclaresTheOrderOfItsThresholds) {
  EXPECT_TRUE(shipped::declares("edges.canny", marrow::not_above("low", "high")));
}

}  // namespace
