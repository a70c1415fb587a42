// SPDX-License-Identifier: Apache-2.0
// A box of metal in an image of two grey values, one in its shadow and one beside it.
#include "tests/harness/node_test.hpp"

namespace marrow::test::silhouette_overlap_test {

/// 2 pixels a mm at the box, whose shadow is 80 x 60 pixels around (100, 100). The box lies x mm beside it.
double cost(double inside, double outside, const std::string& polarity, double x_mm) {
  View view = even_view("first", pinhole(2000, 200, 200, {{100, 100}}), outside);
  view.image.pixels(cv::Rect(60, 70, 81, 61)).setTo(inside);
  return cost_by("similarity.silhouette_overlap",
                 {{"model", item(box({0, 0, 0}, {40, 30, 0.02}))}, {"views", each_view(view)}},
                 {{"polarity", polarity}, {"band_px", 20.0}})
      ->value(placed({x_mm, 0, 1000}));
}

TEST(SilhouetteOverlap, IsWholeWhereTheMetalIs) {
  struct Metal {
    std::string polarity;
    double inside, outside;
  };
  for (const auto& [polarity, inside, outside] :
       {Metal{"dark", 10, 200}, Metal{"bright", 200, 10}, Metal{"either", 10, 200}, Metal{"either", 200, 10}}) {
    double before = cost(inside, outside, polarity, 0);
    EXPECT_NEAR(before, 0, 0.03);
    for (const double off_mm : {2.0, 5.0, 10.0, 15.0}) {
      const double value = cost(inside, outside, polarity, off_mm);
      EXPECT_GT(value, before) << polarity << ' ' << off_mm;
      before = value;
    }
  }
}

TEST(SilhouetteOverlap, IsTheWorstWithoutMetalOfThePolarity) {
  EXPECT_EQ(cost(200, 10, "dark", 0), 1);
  EXPECT_EQ(cost(10, 200, "bright", 0), 1);
  EXPECT_EQ(cost(90, 90, "either", 0), 1);
}

// Shifted by 10 mm, 20 pixels: of the silhouette's 80 columns, 60 are on metal. The band adds 20 pixels around, with
// round corners. The squared Matthews correlation follows from the four counts.
TEST(SilhouetteOverlap, IsTheMatthewsCorrelation) {
  const double in = 80 * 60, band = 2 * 20 * (80 + 60) + 3.14159 * 20 * 20, metal_in = 60 * 60, metal_out = 20 * 60;
  const double all = in + band, metal = metal_in + metal_out;
  const double phi =
      (metal_in * (band - metal_out) - (in - metal_in) * metal_out) / std::sqrt(in * band * metal * (all - metal));
  EXPECT_NEAR(cost(10, 200, "dark", 10), 1 - phi * phi, 0.02);
}

}  // namespace marrow::test::silhouette_overlap_test
