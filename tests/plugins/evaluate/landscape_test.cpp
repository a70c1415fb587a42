// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include "shipped.hpp"
#include "tests/plugins/project/shapes.hpp"

namespace landscape_test {

/// A bowl about a known pose: squared offset in degrees and mm about a frame away from the origin.
class Bowl : public marrow::Cost {
 public:
  Bowl(marrow::RigidTransform floor, marrow::FragmentFrame frame)
      : floor_(std::move(floor)), frame_(std::move(frame)) {}
  double value(const marrow::RigidTransform& pose) const override {
    const marrow::Vector6d motion = marrow::motion_between(floor_, pose, frame_);
    return motion.head<3>().squaredNorm() * marrow::degrees(1) * marrow::degrees(1) + motion.tail<3>().squaredNorm();
  }
  std::shared_ptr<const marrow::Cost> at_level(const marrow::CostLevel&) const override { return nullptr; }

 private:
  marrow::RigidTransform floor_;
  marrow::FragmentFrame frame_;
};

TEST(Landscape, IsTheCostAlongEachAxisOfTheFragment) {
  marrow::Pose pose;
  pose.world_from_model.rotation = marrow::rotation_from_vector({0.1, -0.2, 0.3});
  pose.world_from_model.translation_mm = {5, 6, 7};
  pose.frame.origin_mm = {10, 20, 300};
  for (int axis = 0; axis < 6; ++axis) {
    marrow::Vector6d motion = marrow::Vector6d::Zero();
    motion[axis] = axis < 3 ? marrow::radians(2.5) : 2.5;
    const marrow::Truth floor{marrow::moved(pose.world_from_model, pose.frame, motion)};
    const auto cost = marrow::Value::of<marrow::Cost>(std::make_shared<const Bowl>(floor.world_from_model, pose.frame));
    const auto landscape =
        shipped::call("evaluate.landscape",
                      {{"cost", cost}, {"pose", shipped::item(pose)}, {"truth", shipped::item(floor)}})
            .at("landscape");
    const auto& profile = landscape.as<marrow::Landscape>().profiles.at(std::size_t(axis));
    EXPECT_EQ(profile.unit, axis < 3 ? "deg" : "mm");
    ASSERT_EQ(profile.costs.size(), 81u);
    EXPECT_NEAR(profile.offsets.front(), -10, 1e-12);
    EXPECT_NEAR(profile.offsets.back(), 10, 1e-12);
    EXPECT_NEAR(profile.costs[50], 0, 1e-9);      // at 2.5, the floor
    EXPECT_NEAR(profile.costs[40], 6.25, 1e-6);   // at the pose itself
    EXPECT_NEAR(profile.costs[80], 56.25, 1e-6);  // 10 - 2.5 squared
    EXPECT_NEAR(profile.truth.value(), 2.5, 1e-9);
  }
}

TEST(Landscape, SpeaksOfTheLongAxisOnlyWhereItIsKnown) {
  marrow::Pose pose;
  const auto cost = marrow::Value::of<marrow::Cost>(std::make_shared<const Bowl>(pose.world_from_model, pose.frame));
  const auto axis_of = [&](const shipped::Inputs& more) {
    shipped::Inputs inputs{{"cost", cost}, {"pose", shipped::item(pose)}};
    inputs.insert(more.begin(), more.end());
    return shipped::call("evaluate.landscape", inputs, {{"profile_points", std::int64_t{3}}})
        .at("landscape")
        .as<marrow::Landscape>()
        .profiles.at(2)
        .axis;
  };
  EXPECT_EQ(axis_of({}), "rotation about the z axis");
  EXPECT_EQ(axis_of({{"model", shipped::item(shapes::cylinder(12, 100))}}), "rotation about the long axis");
}

}  // namespace landscape_test
