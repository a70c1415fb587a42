// SPDX-License-Identifier: Apache-2.0
#include "tests/plugins/shaft/scenes.hpp"

namespace marrow::test::shaft_test {

using namespace scenes;

INSTANTIATE_TEST_SUITE_P(, Shaft, testing::Values("hough_pairs", "line_segments", "ransac"),
                         [](const auto& node) { return node.param; });

TEST_P(Shaft, DeclaresADeviationForEachWidth) {
  EXPECT_TRUE(declares(node(), same_length({"width_mm", "width_deviation_mm"})));
}

TEST_P(Shaft, SaysWhatIsWrongWithItsInputs) {
  EXPECT_EQ(message_of([&] { find_shaft(no_edges(), empty_view()); }),
            "view 'frontal': the edge map is empty, so there is no shaft in it; look at the image, and lower the "
            "thresholds of the edge detector");
  EdgeMap edges = no_edges();
  draw(edges, {200, 20}, {200, 400}, kLeft);
  EXPECT_EQ(
      message_of([&] { find_shaft(edges, empty_view(256)); }),
      "view 'frontal': the edge map is for 512 x 512 pixels, the view has 256 x 256; wire the edges of this view");
}

}  // namespace marrow::test::shaft_test
