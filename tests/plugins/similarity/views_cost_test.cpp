// SPDX-License-Identifier: Apache-2.0
// What costs of several views share: blocks, sums, the mean over views, and the cost without each block.
#include "marrow/toolbox/match/views_cost.hpp"
#include "marrow/similarity/block_expansions.hpp"
#include "tests/plugins/project/shapes.hpp"

namespace marrow::test::views_cost_test {

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

}  // namespace marrow::test::views_cost_test
