// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <cmath>

#include "shipped.hpp"

namespace edges_figures_test {

using namespace marrow;

/// Edges along the line u = `u_px`, whose directions point to the right.
EdgeMap line(double u_px, int from_v, int to_v) {
  EdgeMap edges{100, 80, {}};
  for (int v = from_v; v < to_v; ++v) edges.pixels.push_back({float(u_px), float(v), 1, 0, 1});
  return edges;
}

std::map<std::string, double> figures_of(const EdgeMap& found, const EdgeMap& truth,
                                         const shipped::Options& options = {}) {
  const auto made =
      shipped::call("evaluate.edges", {{"edges", shipped::item(found)}, {"truth", shipped::item(truth)}}, options);
  std::map<std::string, double> figures;
  for (const auto& item : made.at("metrics").as<Metrics>().items) figures[item.name] = item.value;
  return figures;
}

TEST(EdgeFigures, AreThoseCountedByHand) {
  // 40 edges lie 0.4 px beside the border, 10 stand 20 px away from it, and 20 of its 60 pixels have none near.
  EdgeMap found = line(30.4, 10, 50);
  for (const EdgePixel& far : line(50, 10, 20).pixels) found.pixels.push_back(far);
  auto figures = figures_of(found, line(30, 10, 70));
  EXPECT_EQ(figures["edges"], 50);
  EXPECT_NEAR(figures["false_alarms"], 0.2, 1e-12);
  EXPECT_NEAR(figures["offset_px"], 0.4, 1e-5);
  EXPECT_NEAR(figures["missed"], 18.0 / 60, 1e-12);  // the last edge is near to pixels up to 2.97 px further on
  figures = figures_of(found, line(30, 10, 70), {{"within_px", 0.5}});
  EXPECT_NEAR(figures["missed"], 20.0 / 60, 1e-12);
  figures = figures_of(found, line(30, 10, 70), {{"within_px", 20.0}});
  EXPECT_EQ(figures["false_alarms"], 0);
}

TEST(EdgeFigures, TheOffsetIsAcrossTheBorder) {
  // Border points 5 px apart: along it, an edge lies up to 2.5 px beside the nearest.
  EdgeMap sparse{100, 80, {}};
  for (int v = 10; v <= 70; v += 5) sparse.pixels.push_back({30, float(v), 1, 0, 1});
  EXPECT_NEAR(figures_of(line(31, 10, 70), sparse)["offset_px"], 1, 1e-12);
}

TEST(EdgeFigures, WithoutEdgesEverythingIsMissed) {
  auto figures = figures_of(line(30, 0, 0), line(30, 10, 70));
  EXPECT_EQ(figures["edges"], 0);
  EXPECT_EQ(figures["missed"], 1);
  EXPECT_TRUE(std::isnan(figures["false_alarms"]));
  EXPECT_TRUE(std::isnan(figures["offset_px"]));
}

TEST(EdgeFigures, OfDifferentImagesOrWithoutBordersAreRefused) {
  EdgeMap other = line(30, 10, 70);
  other.width_px = 101;
  EXPECT_EQ(shipped::refusal("evaluate.edges",
                             {{"edges", shipped::item(other)}, {"truth", shipped::item(line(30, 10, 70))}}, {}),
            "the edges are of an image of 101 x 80 pixels, but the true borders of one of 100 x 80; compare edges of "
            "the same view");
  EXPECT_EQ(shipped::refusal("evaluate.edges",
                             {{"edges", shipped::item(other)}, {"truth", shipped::item(EdgeMap{101, 80, {}})}}, {}),
            "the image shows no true border, so there is nothing to compare");
}

}  // namespace edges_figures_test
