// SPDX-License-Identifier: Apache-2.0
// What costs of several views share: blocks, sums, the mean over views, and the cost without each block.
#include "marrow/similarity/block_expansions.hpp"
#include "marrow/similarity/smoothed_at_bone.hpp"
#include "marrow/toolbox/match/nearest_edges.hpp"
#include "tests/plugins/project/shapes.hpp"

namespace marrow::test::parts_test {

using match::Blocks;
using match::BlockSums;

TEST(Blocks, CoverTheImage) {
  Camera camera = shapes::c_arm(0, 1000);
  camera.height_px = 300;
  const Blocks blocks = Blocks::of(camera);
  EXPECT_EQ(blocks.side_px, 125) << "an eighth of the longer side";
  EXPECT_EQ(blocks.columns, 8);
  EXPECT_EQ(blocks.rows, 3);
  EXPECT_EQ(blocks.count(), 24);
  EXPECT_EQ(blocks.at(0, 0), 0);
  EXPECT_EQ(blocks.at(124.9, 124.9), 0);
  EXPECT_EQ(blocks.at(125, 0), 1);
  EXPECT_EQ(blocks.at(0, 125), 8);
  EXPECT_EQ(blocks.at(999, 299), 23);
  EXPECT_EQ(blocks.at(2000, -5), 7) << "beyond the image counts as its border";
  EXPECT_EQ(Blocks::of(camera, 5).side_px, 200);
}

// An image of twice as many pixels has the same blocks, so it gives the same deviations.
TEST(Blocks, AreTheSamePartsOfAnImageOfAnySize) {
  for (const int along : {5, 8, 10})
    for (const int width_px : {50, 200, 253, 383, 500, 512}) {
      Camera camera = shapes::c_arm(0, width_px);
      camera.height_px = 3 * width_px / 5;
      const Blocks blocks = Blocks::of(camera, along);
      EXPECT_NEAR(blocks.side_px, double(width_px) / along, 0.03 * width_px / along);
      for (int times = 2; times < 16; times *= 2) {
        Camera larger = camera;
        larger.width_px *= times;
        larger.height_px *= times;
        const Blocks same = Blocks::of(larger, along);
        EXPECT_NEAR(same.side_px, times * blocks.side_px, 0.01 * same.side_px) << width_px << " x " << times;
        if (width_px * times >= 768) continue;  // sides are whole pixels; the smaller image has no half pixels
        EXPECT_EQ(same.side_px, times * blocks.side_px) << width_px << " x " << times;
        EXPECT_EQ(same.columns, blocks.columns);
        EXPECT_EQ(same.rows, blocks.rows);
      }
    }
}

TEST(BlockSums, WithoutEachBlock) {
  BlockSums sums(Blocks{10, 2, 1});
  sums.add(3, 0, 1, 2);
  sums.add(4, 0, 2, 2);
  sums.add(15, 0, 10, 1);
  EXPECT_EQ(sums.all().values, 13);
  EXPECT_EQ(sums.all().weights, 5);
  EXPECT_EQ(sums.without_each([](const auto& left) { return left.values / left.weights; }), (Numbers{10, 0.75}));
}

TEST(BlockExpansions, WithoutEachBlock) {
  using match::BlockExpansions;
  BlockExpansions first(Blocks{10, 2, 1}), second(Blocks{10, 1, 1});
  const Vector6d along = Vector6d::Unit(3);
  first.add(3, 0, along, 2, 3);
  first.add(15, 0, 2 * along, 1, 5);
  second.add(0, 0, along, -3, 1);
  for (const double u_px : {3.0, 4.0, 15.0}) first.count(u_px, 0);
  second.count(0, 0);
  // The sums of first are 2 + 2 and 3 + 20, of 3 points; those of second -3 and 1, of one. The weights are 3 : 1.
  const auto kept = BlockExpansions::without_each({first, second}, {3, 1}, 0.5, false);
  ASSERT_EQ(kept.size(), 3u);
  EXPECT_DOUBLE_EQ(kept[0].gradient[3], 0.75 * 2 - 0.25 * 3);
  EXPECT_DOUBLE_EQ(kept[0].curvature(3, 3), 0.75 * 20 + 0.25 * 1);
  EXPECT_DOUBLE_EQ(kept[1].gradient[3], 0.75 * 2 / 2 - 0.25 * 3);
  EXPECT_DOUBLE_EQ(kept[1].curvature(3, 3), 0.75 * 3 / 2 + 0.25 * 1);
  EXPECT_DOUBLE_EQ(kept[2].gradient[3], 0.75 * 4 / 3);
  EXPECT_DOUBLE_EQ(kept[2].curvature(3, 3), 0.75 * 23 / 3);
  // Two points count as four. With a common offset o, second derivatives by (x, o) are 3, -3, 3 in the one block and
  // 20, -10, 5 in the other. First ones are 2, -2 and 2, -1.
  const auto free = BlockExpansions::without_each({first}, {1}, 4, true);
  ASSERT_EQ(free.size(), 2u);
  EXPECT_NEAR(free[0].curvature(3, 3), (20 - 100 / 5.0) / 4, 1e-12);
  EXPECT_NEAR(free[0].gradient[3], (2 - 10 * 1 / 5.0) / 4, 1e-12);
  EXPECT_NEAR(free[1].curvature(3, 3), 0, 1e-12);
  const auto bound = BlockExpansions::without_each({first}, {1}, 4, false);
  EXPECT_DOUBLE_EQ(bound[1].curvature(3, 3), 3 / 4.0);
}

/// A cost that is 1 in the first view and 5 + x in the second. Without its single block, a view is 0.
class Two : public match::ViewsCost {
 public:
  explicit Two(const Numbers& weights) : ViewsCost(2, weights) {}
  double value_in_view(std::size_t view, const RigidTransform& pose) const override {
    return view == 0 ? 1 : 5 + pose.translation_mm.x();
  }
  std::shared_ptr<const Cost> at_level(const CostLevel&) const override { return nullptr; }

 private:
  Split split(std::size_t view, const RigidTransform& pose) const override {
    return {value_in_view(view, pose), {0.0}};
  }
};

TEST(ViewsCost, IsTheWeightedMean) {
  const RigidTransform pose = placed({2, 0, 0});
  EXPECT_EQ(Two({}).value(pose), 4);
  EXPECT_EQ(Two({3, 1}).value(pose), 2.5);
  EXPECT_EQ(Two({3, 1}).view_count(), 2u);
  EXPECT_EQ(Two({}).without_each_block(pose), (Numbers{3.5, 0.5}));
  EXPECT_EQ(Two({3, 1}).without_each_block(pose), (Numbers{1.75, 0.75}));
}

/// Three views. A view whose text is not empty is silent for this reason.
class Silent : public match::ViewsCost {
 public:
  Silent(const Numbers& weights, Strings silences) : ViewsCost(3, weights), silences_(std::move(silences)) {}
  double value_in_view(std::size_t, const RigidTransform&) const override { return 1; }
  std::shared_ptr<const Cost> at_level(const CostLevel&) const override { return nullptr; }

 private:
  Split split(std::size_t, const RigidTransform&) const override { return {1, {1.0}}; }
  std::string silence(std::size_t view, const RigidTransform&) const override { return silences_[view]; }
  Strings silences_;
};

TEST(ViewsCost, SaysNothingWhereNoneOfItsViewsDoes) {
  const RigidTransform pose{"world", "ct"};
  using Texts = Strings;
  const Silent some({}, {"a is empty", "", "c is empty"}), all({}, {"a is empty", "b is empty", "c is empty"});
  EXPECT_EQ(some.silent_views(pose), (Texts{"a is empty", "c is empty"}));
  EXPECT_EQ(some.nothing_compared(pose), "");
  EXPECT_EQ(all.nothing_compared(pose), "a is empty; b is empty; c is empty");
  // A view with weight 0 is not named, and the cost stays silent although this view shows something.
  const Silent without_second({1, 0, 1}, {"a is empty", "", "c is empty"});
  EXPECT_EQ(without_second.nothing_compared(pose), "a is empty; c is empty");
  EXPECT_EQ(Silent({1, 0, 1}, {"", "b is empty", ""}).silent_views(pose), Texts{});
  EXPECT_EQ(Two({}).nothing_compared(pose), "") << "a cost that does not say";
}

// The nearest edge of each pixel and direction, compared with a search through all edges.

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

const Vector3d kMiddle_mm(120, -80, 300), kHalf_mm(20, 30, 60);

/// A model in a box. Every value of its radiograph is the variance in mm^2 by which it was smoothed.
class Box : public RadiographProjector {
 public:
  explicit Box(double sigma_mm = 0) : variance_mm2_(sigma_mm * sigma_mm) {}
  std::vector<float> radiograph(const Camera&, const RigidTransform&, const PixelGrid& grid) const override {
    return std::vector<float>(grid.count(), float(variance_mm2_));
  }
  std::vector<float> radiograph(const Camera&, const RigidTransform&,
                                const std::vector<Eigen::Vector2f>& pixels) const override {
    return std::vector<float>(pixels.size(), float(variance_mm2_));
  }
  PixelGrid region(const Camera& camera, const RigidTransform& world_from_model) const override {
    Vector2d low(1e9, 1e9), high(-1e9, -1e9);
    for (int corner = 0; corner < 8; ++corner) {
      const Vector3d side(corner & 1 ? 1 : -1, corner & 2 ? 1 : -1, corner & 4 ? 1 : -1);
      const Vector2d pixel = project(camera, world_from_model * (kMiddle_mm + side.cwiseProduct(kHalf_mm)));
      low = low.cwiseMin(pixel), high = high.cwiseMax(pixel);
    }
    low = low.array().floor().max(0);
    high = high.array().ceil().min(Eigen::Array2d(camera.width_px - 1, camera.height_px - 1));
    return {low.x(), low.y(), 1, int(high.x() - low.x()) + 1, int(high.y() - low.y()) + 1};
  }
  std::shared_ptr<const RadiographProjector> smoothed(double sigma_mm) const override {
    return std::make_shared<const Box>(sigma_mm);
  }

 private:
  double variance_mm2_;
};

const Camera kCamera = pinhole(1000, 400, 400, {{200, 200}});

/// The model upright or on its side, with its middle this far from the source.
RigidTransform at_depth(double depth_mm, double turn_rad = 0) {
  RigidTransform pose = placed({0, 0, depth_mm}, {turn_rad, 0, 0});
  pose.translation_mm -= pose.rotation * kMiddle_mm;
  return pose;
}

// 2 px are 2 * depth / 1000 mm at the depth of the model's middle.
TEST(SmoothedAtBone, IsAsSmoothAsTheImageWhereverTheModelIs) {
  const Box box;
  const auto smoothed = match::smoothed_at_bone(box, 2);
  ASSERT_TRUE(smoothed);
  for (const double depth_mm : {300.0, 512.0, 600.0, 600.1, 811.0, 1450.0})
    for (const double turn : {0.0, 1.2}) {
      const double expected = std::pow(2 * depth_mm / 1000, 2);
      const auto values = smoothed->radiograph(kCamera, at_depth(depth_mm, turn), PixelGrid{10, 10, 1, 2, 1});
      ASSERT_EQ(values.size(), 2u);
      EXPECT_NEAR(values[0], expected, 1e-4 * expected) << depth_mm;
      EXPECT_EQ(smoothed->radiograph(kCamera, at_depth(depth_mm, turn), {{3.0f, 4.0f}})[0], values[0]);
    }
}

TEST(SmoothedAtBone, ChangesWithoutAJump) {
  const Box box;
  const auto smoothed = match::smoothed_at_bone(box, 2);
  double before = 0;
  for (double depth_mm = 400; depth_mm < 1200; depth_mm += 0.5) {
    const double value = smoothed->radiograph(kCamera, at_depth(depth_mm), PixelGrid{0, 0, 1, 1, 1})[0];
    if (before > 0) {
      EXPECT_NEAR(value / before, 1 + 2 * 0.5 / depth_mm, 1e-5) << depth_mm;
    }
    before = value;
  }
}

TEST(SmoothedAtBone, ItsRegionHoldsTheBlurredModel) {
  const Box box;
  const PixelGrid sharp = box.region(kCamera, at_depth(900)),
                  soft = match::smoothed_at_bone(box, 2)->region(kCamera, at_depth(900));
  EXPECT_EQ(soft.u_px, sharp.u_px - 6);
  EXPECT_EQ(soft.columns, sharp.columns + 12);
  EXPECT_EQ(soft.rows, sharp.rows + 12);
}

}  // namespace marrow::test::parts_test
