// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include "domain/shapes.hpp"
#include "evaluate/poses.hpp"

namespace {

using shipped::figure;

/// A bar of 20 x 20 x 100 mm, sawn through at its middle.
const marrow::Mesh kLower = marrow::test::box({0, 0, -25}, {20, 20, 50}), kUpper = marrow::test::box({0, 0, 25}, {20, 20, 50});

template <class T>
marrow::Value both(T lower, T upper) {
  marrow::List<T> list;
  list.add("distal", std::move(lower));
  list.add("proximal", std::move(upper));
  return shipped::list(list, "fragment");
}

marrow::RigidTransform placed(const Eigen::Vector3d& turn_rad, const Eigen::Vector3d& shift_mm) {
  return {"world", "ct", marrow::rotation_from_vector(turn_rad), shift_mm};
}
marrow::Pose pose(const marrow::RigidTransform& world_from_model) {
  marrow::Pose pose;
  pose.world_from_model = world_from_model;
  return pose;
}

TEST(PoseDifference, OfATurnAndAShift) {
  const auto metrics = shipped::call("evaluate.pose_difference", {{"pose", shipped::item(pose(placed({0, 0, marrow::radians(10)}, {0, 0, -5})))},
                                                                  {"reference", shipped::item(pose(placed({0, 0, 0}, {0, 0, 0})))}, {"model", shipped::item(kLower)}}).at("metrics");
  EXPECT_NEAR(figure(metrics, "rotation_deg"), 10, 1e-9);
  EXPECT_NEAR(figure(metrics, "axial_deg"), 10, 1e-9);
  EXPECT_NEAR(figure(metrics, "translation_mm"), 5, 1e-9);
  EXPECT_GT(figure(metrics, "distance_mm"), 5);
  EXPECT_LT(figure(metrics, "distance_mm"), std::hypot(5.0, marrow::radians(10) * 15));
}

TEST(PoseDifference, RefusesPosesOfOtherFrames) {
  marrow::Pose other;
  other.world_from_model.source = "mri";
  EXPECT_EQ(shipped::refusal("evaluate.pose_difference", {{"pose", shipped::item(pose(placed({0, 0, 0}, {0, 0, 0})))}, {"reference", shipped::item(other)}, {"model", shipped::item(kLower)}}),
            "the pose is world_from_ct, but the reference is world_from_mri; compare poses between the same two frames");
}

// The lower half truly lies 8 mm to the side and is found there: the reduction closes the gap.
TEST(ReductionGap, ExactPosesCloseIt) {
  const auto moved = placed({0, 0, 0}, {8, 0, 0}), stays = placed({0, 0, 0.3}, {5, 5, 5});
  const auto metrics = shipped::call("evaluate.reduction_gap", {{"poses", both(pose(moved), pose(stays))}, {"truths", both(marrow::Truth{moved}, marrow::Truth{stays})},
                                                                {"models", both(kLower, kUpper)}}).at("metrics");
  EXPECT_GT(figure(metrics, "before_mm"), 5);
  EXPECT_NEAR(figure(metrics, "gap_mm"), 0, 1e-9);
  EXPECT_NEAR(figure(metrics, "largest_gap_mm"), 0, 1e-9);
  EXPECT_NEAR(figure(metrics, "rotation_deg"), 0, 1e-5);
}

// Found 0.5 mm too high: the reduction leaves it 0.5 mm too low, all over.
TEST(ReductionGap, AnErrorOfAPoseStaysOpen) {
  const auto truth = placed({0, 0, 0}, {8, 0, 0}), found = placed({0, 0, 0}, {8, 0, 0.5}), stays = placed({0, 0, 0}, {0, 0, 0});
  const auto metrics = shipped::call("evaluate.reduction_gap", {{"poses", both(pose(found), pose(stays))}, {"truths", both(marrow::Truth{truth}, marrow::Truth{stays})},
                                                                {"models", both(kLower, kUpper)}}).at("metrics");
  EXPECT_NEAR(figure(metrics, "before_mm"), 8, 1e-9);
  EXPECT_NEAR(figure(metrics, "gap_mm"), 0.5, 1e-9);
  EXPECT_NEAR(figure(metrics, "largest_gap_mm"), 0.5, 1e-9);
  EXPECT_NEAR(figure(metrics, "translation_mm"), 0.5, 1e-9);
}

TEST(ReductionGap, SaysWhatIsWrong) {
  const auto here = placed({0, 0, 0}, {0, 0, 0});
  const shipped::Inputs good{{"poses", both(pose(here), pose(here))}, {"truths", both(marrow::Truth{here}, marrow::Truth{here})}, {"models", both(kLower, kUpper)}};
  EXPECT_EQ(shipped::refusal("evaluate.reduction_gap", good, {{"moved", std::string("middle")}}),
            "poses: there is none of a fragment 'middle', only of distal, proximal; name both fragments with moved and reference");
  shipped::Inputs apart = good;
  apart["models"] = both(kLower, marrow::test::box({0, 0, 35}, {20, 20, 30}));
  EXPECT_EQ(shipped::refusal("evaluate.reduction_gap", apart),
            "the surfaces of 'distal' and 'proximal' are nowhere within border_mm of each other; they are no two sides of a fracture, or raise border_mm");
}

}  // namespace
