// SPDX-License-Identifier: Apache-2.0
// project.together: line integrals of several bones add.
#include "marrow/toolbox/analytic/body.hpp"
#include "tests/harness/node_test.hpp"

namespace marrow::test::together_test {

using analytic::Body, analytic::BodyProjector, analytic::c_arm;

const Body kFirst{{{0, 0, 0}, {9, 12, 20}}}, kSecond{{{0, 0, 0}, {7, 7, 15}}};
RigidTransform at(double x_mm) { return analytic::moved_by({0, 0, 0}, {x_mm, 0, 5}); }
Camera camera() { return c_arm(20, 160, 160, 1); }
PixelGrid whole() { return {0, 0, 1, 160, 160}; }

struct Pair {
  std::shared_ptr<const RadiographProjector> first = std::make_shared<const BodyProjector>(kFirst),
                                             second = std::make_shared<const BodyProjector>(kSecond);
  Inputs inputs(bool with_pose_of_second = true) const {
    List<RadiographProjector> projectors;
    projectors.add_shared("first", first);
    projectors.add_shared("second", second);
    List<Pose> poses;
    if (with_pose_of_second) {
      Pose pose;
      pose.world_from_model = at(12);
      poses.add("second", pose);
    }
    return {{"projector", Value::of<RadiographProjector>(first)},
            {"other_projectors", shipped::list(projectors, "fragment")},
            {"others", shipped::list(poses, "fragment")}};
  }
};

std::vector<float> sum_of(const Pair& pair, const RigidTransform& first, const PixelGrid& grid) {
  std::vector<float> values = pair.first->radiograph(camera(), first, grid);
  const std::vector<float> other = pair.second->radiograph(camera(), at(12), grid);
  for (std::size_t i = 0; i < values.size(); ++i) values[i] += other[i];
  return values;
}

TEST(Together, LineIntegralsAddWhereverTheBoneIs) {
  const Pair pair;
  const Value made = call("project.together", pair.inputs()).at("projector");
  const auto& both = made.as<RadiographProjector>();
  for (const double x_mm : {-10.0, 0.0, 14.0})
    // Whole images, every third pixel, and a grid that is not aligned with the pixels that are kept.
    for (const PixelGrid& grid : {whole(), PixelGrid{30, 45, 3, 30, 20}, PixelGrid{31, 40, 2, 20, 30}})
      EXPECT_EQ(both.radiograph(camera(), at(x_mm), grid), sum_of(pair, at(x_mm), grid)) << x_mm << " " << grid.step_px;
  const std::vector<Eigen::Vector2f> pixels{{80, 80}, {95, 70}, {3, 3}};
  const std::vector<float> values = both.radiograph(camera(), at(0), pixels),
                           first = pair.first->radiograph(camera(), at(0), pixels),
                           second = pair.second->radiograph(camera(), at(12), pixels);
  for (std::size_t i = 0; i < pixels.size(); ++i) EXPECT_FLOAT_EQ(values[i], first[i] + second[i]);
}

TEST(Together, TheRegionHoldsAllBones) {
  const Pair pair;
  const Value made = call("project.together", pair.inputs()).at("projector");
  const auto& both = made.as<RadiographProjector>();
  const PixelGrid region = both.region(camera(), at(-15));
  const std::vector<float> values = both.radiograph(camera(), at(-15), whole());
  double outside = 0, inside = 0;
  for (int v = 0; v < 160; ++v)
    for (int u = 0; u < 160; ++u) {
      const bool is_in =
          u >= region.u_px && v >= region.v_px && u < region.u_px + region.columns && v < region.v_px + region.rows;
      (is_in ? inside : outside) += double(values[std::size_t(v) * 160 + std::size_t(u)]);
    }
  EXPECT_EQ(outside, 0);
  EXPECT_GT(inside, 0);
  EXPECT_LT(region.count(), whole().count());
}

TEST(Together, NothingIsDrawnWhereTheBoneItselfIsOutOfView) {
  const Pair pair;
  const Value made = call("project.together", pair.inputs()).at("projector");
  const auto& both = made.as<RadiographProjector>();
  EXPECT_EQ(both.region(camera(), at(500)).count(), 0u);
  for (const float value : both.radiograph(camera(), at(500), whole())) ASSERT_EQ(value, 0);
}

TEST(Together, RefusesABoneWithoutAPose) {
  EXPECT_EQ(refusal("project.together", Pair().inputs(false)),
            "other_projectors has the fragment 'second', but others has no pose of it; give the poses of the same "
            "fragments");
}

}  // namespace marrow::test::together_test
