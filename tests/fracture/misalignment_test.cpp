// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <cmath>

#include "poses.hpp"

namespace misalignment_test {

using fracture_poses::displaced, fracture_poses::inputs;
using shipped::figure;

marrow::Value misalignment(const marrow::Vector6d& motion_deg_mm) {
  return shipped::call("fracture.misalignment", inputs(displaced(motion_deg_mm))).at("metrics");
}

TEST(Misalignment, IsTheMotionAboutTheFragmentsOwnAxes) {
  // Small enough that the rotation vector's parts are rotations about the axes.
  const auto found = misalignment({3, 0, 0, 2, -4, 5});
  EXPECT_NEAR(figure(found, "angulation_frontal_axis_deg"), 3, 1e-9);
  EXPECT_NEAR(figure(found, "angulation_deg"), 3, 1e-9);
  EXPECT_NEAR(figure(found, "malrotation_deg"), 0, 1e-9);
  EXPECT_NEAR(figure(found, "shift_frontal_mm"), 2, 1e-9);
  EXPECT_NEAR(figure(found, "shift_lateral_mm"), -4, 1e-9);
  EXPECT_NEAR(figure(found, "shift_mm"), std::sqrt(20), 1e-9);
  EXPECT_NEAR(figure(found, "shortening_mm"), 5, 1e-9) << "towards the proximal fragment, so they overlap";
  EXPECT_NEAR(figure(misalignment({0, 0, 20, 0, 0, -7}), "malrotation_deg"), 20, 1e-9);
  EXPECT_NEAR(figure(misalignment({0, 0, 20, 0, 0, -7}), "shortening_mm"), -7, 1e-9) << "drawn apart";
}

TEST(Misalignment, NoneWhereNothingMoved) {
  const auto found = misalignment(marrow::Vector6d::Zero());
  for (const marrow::Metric& metric : found.as<marrow::Metrics>().items)
    EXPECT_NEAR(metric.value, 0, 1e-9) << metric.name;
}

TEST(Misalignment, RefusesOtherFragments) {
  const auto message = [](const marrow::List<marrow::Pose>& poses, const shipped::Options& options) {
    return shipped::refusal("fracture.misalignment", inputs(poses), options);
  };
  const std::string distal = "distal", shaft = "shaft";
  auto poses = displaced(marrow::Vector6d::Zero());
  EXPECT_EQ(message(poses, {{"moved", distal}, {"reference", shaft}}),
            "there is no pose of a fragment 'shaft', only of proximal, distal; name both fragments with moved and "
            "reference, and register both");
  EXPECT_EQ(message(poses, {{"moved", distal}, {"reference", distal}}),
            "moved and reference both name 'distal'; they must be two fragments");
  for (const auto frame : {&marrow::RigidTransform::source, &marrow::RigidTransform::target}) {
    marrow::List<marrow::Pose> mixed;
    marrow::Pose other = poses[1];
    other.world_from_model.*frame = "elsewhere";
    mixed.add("proximal", poses[0]);
    mixed.add("distal", other);
    EXPECT_EQ(message(mixed, {}),
              "the poses of 'proximal' and 'distal' are between other frames; both fragments must come from one CT");
  }
}

}  // namespace misalignment_test
