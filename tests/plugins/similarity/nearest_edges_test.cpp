// SPDX-License-Identifier: Apache-2.0
// The nearest edge of each pixel and direction, compared with a search through all edges.
#include "marrow/toolbox/match/nearest_edges.hpp"
#include "tests/harness/node_test.hpp"

namespace marrow::test::nearest_edges_test {

constexpr double kTolerance_rad = 0.4;

EdgeMap random_edges(int width, int height, int count, std::mt19937& random) {
  std::uniform_real_distribution<float> part(0, 1);
  EdgeMap edges{width, height, {}};
  const float middle = 6.2831853f * part(random);
  for (int i = 0; i < count; ++i) {
    const float angle =
        i % 2 ? 6.2831853f * part(random) : middle + part(random);  // half of them are alike, so smoothing moves them
    const float u_px = -0.49f + (float(width) - 0.02f) * part(random),
                v_px = -0.49f + (float(height) - 0.02f) * part(random);
    edges.pixels.push_back({u_px, v_px, std::cos(angle), std::sin(angle), part(random)});
  }
  return edges;
}

/// The diamond |u| + |v| = 1 is divided into 16 sectors. Returns the middle of the sector of a direction.
Vector2d middle_of_sector(const Vector2d& direction) {
  const Vector2d corners[5] = {{1, 0}, {0, 1}, {-1, 0}, {0, -1}, {1, 0}};
  const int quadrant = direction.y() >= 0 ? (direction.x() > 0 ? 0 : 1) : (direction.x() < 0 ? 2 : 3);
  const Vector2d from = corners[quadrant], to = corners[quadrant + 1];
  const double part = std::abs(direction.dot(to)) / direction.lpNorm<1>();
  return (from + (std::floor(4 * part) + 0.5) / 4 * (to - from)).normalized();
}

/// The cell of 2 x 2 pixels. Edges that smoothing moved out of the image count at its border.
Eigen::Vector2i cell_of(float u, float v, int width, int height) {
  return {std::min(int(u + 0.5f) / 2, (width - 1) / 2), std::min(int(v + 0.5f) / 2, (height - 1) / 2)};
}

void compare_with_a_search(int width, int height, int count, unsigned seed) {
  std::mt19937 random(seed);
  const match::NearestEdges nearest(random_edges(width, height, count, random), {}, kTolerance_rad);
  ASSERT_EQ(nearest.all().size(), std::size_t(count));
  for (int sector = 0; sector < 16; ++sector) {
    const double angle = 2 * 3.14159265358979 * (sector + 0.4) / 16;
    const Vector2d direction(std::cos(angle), std::sin(angle)), middle = middle_of_sector(direction);
    for (int v = 0; v < height; ++v)
      for (int u = 0; u < width; ++u) {
        const Eigen::Vector2i from = cell_of(float(u), float(v), width, height);
        int least = std::numeric_limits<int>::max();
        for (const EdgePixel& edge : nearest.all())
          if (edge.direction_u * middle.x() + edge.direction_v * middle.y() >= std::cos(kTolerance_rad))
            least = std::min(least, (cell_of(edge.u_px, edge.v_px, width, height) - from).squaredNorm());
        const EdgePixel* found = nearest.find(float(u), float(v), float(direction.x()), float(direction.y()));
        ASSERT_EQ(found == nullptr, least == std::numeric_limits<int>::max());
        if (!found) continue;
        const Eigen::Vector2i cell = cell_of(found->u_px, found->v_px, width, height);
        ASSERT_EQ((cell - from).squaredNorm(), least) << "at " << u << ' ' << v << " in sector " << sector;
        for (const EdgePixel& edge : nearest.all())
          if (edge.direction_u * middle.x() + edge.direction_v * middle.y() >= std::cos(kTolerance_rad) &&
              cell_of(edge.u_px, edge.v_px, width, height) == cell) {
            ASSERT_LE(edge.magnitude, found->magnitude) << "a cell keeps its strongest edge";
          }
      }
  }
}

TEST(NearestEdges, AreThoseThatASearchFinds) {
  for (unsigned seed = 0; seed < 4; ++seed) {
    compare_with_a_search(40, 32, 400, seed);
    compare_with_a_search(33, 41, 60, seed);
    compare_with_a_search(20, 8, 3, seed);
  }
  for (unsigned seed = 0; seed < 40; ++seed) compare_with_a_search(12, 10, 80, seed);  // often moved out of the image
}

TEST(NearestEdges, LieInsideTheMaskAndTheImage) {
  EdgeMap edges{20, 10, {}};
  for (const float u : {-0.6f, 2.0f, 12.0f, 19.6f}) edges.pixels.push_back({u, 4, 1, 0, 1});
  for (const float v : {-0.6f, 9.6f}) edges.pixels.push_back({12, v, 1, 0, 1});
  EXPECT_EQ(match::NearestEdges(edges, {}, kTolerance_rad).all().size(), 2u);
  cv::Mat mask(10, 20, CV_8U, cv::Scalar(0));
  mask(cv::Rect(10, 0, 10, 10)).setTo(1);
  const match::NearestEdges inside(edges, mask, kTolerance_rad);
  ASSERT_EQ(inside.all().size(), 1u);
  EXPECT_EQ(inside.find(0, 0, 1, 0)->u_px, 12);
  EXPECT_EQ(inside.find(0, 0, -1, 0), nullptr) << "seen from the other side";
  EXPECT_TRUE(match::NearestEdges(edges, cv::Mat(10, 20, CV_8U, cv::Scalar(0)), kTolerance_rad).empty());
}

TEST(NearestEdges, AreSmoothedAlongTheirBorder) {
  // A vertical border at u = 10. Its pixels are off by 0.3 px to the left and to the right in turn.
  EdgeMap edges{20, 21, {}};
  for (int v = 0; v < 21; ++v) edges.pixels.push_back({v % 2 ? 10.3f : 9.7f, float(v), 1, 0, 1});
  edges.pixels.push_back({12.5f, 10, 1, 0, 1});   // too far away
  edges.pixels.push_back({10.6f, 10, -1, 0, 1});  // another border
  const match::NearestEdges nearest(edges, {}, kTolerance_rad);
  // Seven pixels are averaged; three or four of them lie on each side.
  for (int v = 3; v < 18; ++v)
    EXPECT_NEAR(nearest.all()[std::size_t(v)].u_px, v % 2 ? 10 - 0.3 / 7 : 10 + 0.3 / 7, 1e-5) << v;
  EXPECT_EQ(nearest.all()[21].u_px, 12.5f);
  EXPECT_EQ(nearest.all()[22].u_px, 10.6f);
}

}  // namespace marrow::test::nearest_edges_test
