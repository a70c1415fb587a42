// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include "shipped.hpp"
#include "tests/framework/domain/shapes.hpp"

namespace two_poses_test {

using shipped::figure;

/// A bar of 20 x 20 x 100 mm, sawn through at its middle.
const marrow::Mesh kLower = marrow::test::box({0, 0, -25}, {20, 20, 50}),
                   kUpper = marrow::test::box({0, 0, 25}, {20, 20, 50});

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
  const auto metrics = shipped::call("evaluate.pose_difference",
                                     {{"pose", shipped::item(pose(placed({0, 0, marrow::radians(10)}, {0, 0, -5})))},
                                      {"reference", shipped::item(pose(placed({0, 0, 0}, {0, 0, 0})))},
                                      {"model", shipped::item(kLower)}})
                           .at("metrics");
  EXPECT_NEAR(figure(metrics, "rotation_deg"), 10, 1e-9);
  EXPECT_NEAR(figure(metrics, "axial_deg"), 10, 1e-9);
  EXPECT_NEAR(figure(metrics, "frontal_deg"), 0, 1e-9);
  EXPECT_NEAR(figure(metrics, "lateral_deg"), 0, 1e-9);
  EXPECT_NEAR(figure(metrics, "translation_mm"), 5, 1e-9);
  EXPECT_NEAR(figure(metrics, "x_mm"), 0, 1e-9);
  EXPECT_NEAR(figure(metrics, "y_mm"), 0, 1e-9);
  EXPECT_NEAR(figure(metrics, "z_mm"), -5, 1e-9);
  EXPECT_GT(figure(metrics, "distance_mm"), 5);
  EXPECT_LT(figure(metrics, "distance_mm"), std::hypot(5.0, marrow::radians(10) * 15));
  // What holds for one point by hand holds for all points of the surface: how far a point turns depends on its distance
  // from the axis.
  double sum = 0;
  for (const Eigen::Vector3d& point : marrow::sample_surface(kLower, 500))
    sum += std::hypot(5.0, 2 * std::sin(marrow::radians(5)) * point.head<2>().norm()) / 500;
  EXPECT_NEAR(figure(metrics, "distance_mm"), sum, 1e-9);
}

TEST(PoseDifference, RefusesPosesOfOtherFrames) {
  marrow::Pose other;
  other.world_from_model.source = "mri";
  EXPECT_EQ(
      shipped::refusal("evaluate.pose_difference", {{"pose", shipped::item(pose(placed({0, 0, 0}, {0, 0, 0})))},
                                                    {"reference", shipped::item(other)},
                                                    {"model", shipped::item(kLower)}}),
      "the pose is world_from_ct, but the reference is world_from_mri; compare poses between the same two frames");
}

// The lower half truly lies 8 mm to the side and is found there: the reduction closes the gap.
TEST(ReductionGap, ExactPosesCloseIt) {
  const auto moved = placed({0, 0, 0}, {8, 0, 0}), stays = placed({0, 0, 0.3}, {5, 5, 5});
  const auto metrics =
      shipped::call("evaluate.reduction_gap", {{"poses", both(pose(moved), pose(stays))},
                                               {"truths", both(marrow::Truth{moved}, marrow::Truth{stays})},
                                               {"models", both(kLower, kUpper)}})
          .at("metrics");
  EXPECT_GT(figure(metrics, "before_mm"), 5);
  EXPECT_NEAR(figure(metrics, "gap_mm"), 0, 1e-9);
  EXPECT_NEAR(figure(metrics, "largest_gap_mm"), 0, 1e-9);
  EXPECT_NEAR(figure(metrics, "rotation_deg"), 0, 1e-5);
}

// Found 0.5 mm too high: the reduction leaves it 0.5 mm too low, all over.
TEST(ReductionGap, AnErrorOfAPoseStaysOpen) {
  const auto truth = placed({0, 0, 0}, {8, 0, 0}), found = placed({0, 0, 0}, {8, 0, 0.5}),
             stays = placed({0, 0, 0}, {0, 0, 0});
  const auto metrics =
      shipped::call("evaluate.reduction_gap", {{"poses", both(pose(found), pose(stays))},
                                               {"truths", both(marrow::Truth{truth}, marrow::Truth{stays})},
                                               {"models", both(kLower, kUpper)}})
          .at("metrics");
  EXPECT_NEAR(figure(metrics, "before_mm"), 8, 1e-9);
  EXPECT_NEAR(figure(metrics, "gap_mm"), 0.5, 1e-9);
  EXPECT_NEAR(figure(metrics, "largest_gap_mm"), 0.5, 1e-9);
  EXPECT_NEAR(figure(metrics, "translation_mm"), 0.5, 1e-9);
}

// Found turned by 2 degrees about x through the fracture. The gap that stays open is this turn of the fracture's
// points, which lie up to 10 mm to the side and, on the walls, up to border_mm below the cut.
TEST(ReductionGap, OfATurnIsWhatTheFractureShows) {
  const auto truth = placed({0, 0, 0}, {0, 0, 0}), found = placed({marrow::radians(2), 0, 0}, {0, 0, 0});
  for (const double border_mm : {3.0, 8.0}) {
    const auto metrics = shipped::call("evaluate.reduction_gap",
                                       {{"poses", both(pose(found), pose(truth))},
                                        {"truths", both(marrow::Truth{truth}, marrow::Truth{truth})},
                                        {"models", both(kLower, kUpper)}},
                                       {{"border_mm", border_mm}})
                             .at("metrics");
    const double turn = 2 * std::sin(marrow::radians(1));
    EXPECT_NEAR(figure(metrics, "rotation_deg"), 2, 1e-9);
    EXPECT_NEAR(figure(metrics, "before_mm"), 0, 1e-9);
    EXPECT_NEAR(figure(metrics, "largest_gap_mm"), turn * std::hypot(10, border_mm), 0.02 * turn * 10);
    // The cut itself (20 x 20, mean |y| of 5), and walls: two at |y| = 10, two at any y, from 0 down to nearly
    // border_mm.
    const auto mean_at = [&](auto y_of) {
      double sum = 0;
      for (int i = 0; i < 200; ++i)
        for (int k = 0; k < 200; ++k) sum += std::hypot(y_of((i + 0.5) / 200), border_mm * (k + 0.5) / 200) / 40000;
      return sum;
    };
    const double walls = 40 * border_mm, mean = (400 * 5 + walls * mean_at([](double) { return 10.0; }) +
                                                 walls * mean_at([](double share) { return 10 * share; })) /
                                                (400 + 2 * walls);
    EXPECT_NEAR(figure(metrics, "gap_mm"), turn * mean, 0.02 * turn * mean);
    EXPECT_NEAR(figure(metrics, "translation_mm"), 25 * turn, 1e-6) << "the centroid lies 25 mm below";
  }
}

TEST(ReductionGap, SaysWhatIsWrong) {
  const auto here = placed({0, 0, 0}, {0, 0, 0});
  const shipped::Inputs good{{"poses", both(pose(here), pose(here))},
                             {"truths", both(marrow::Truth{here}, marrow::Truth{here})},
                             {"models", both(kLower, kUpper)}};
  EXPECT_EQ(shipped::refusal("evaluate.reduction_gap", good, {{"moved", std::string("middle")}}),
            "there is no pose of a fragment 'middle', only of distal, proximal; name both fragments with moved and "
            "reference");
  shipped::Inputs apart = good;
  apart["models"] = both(kLower, marrow::test::box({0, 0, 35}, {20, 20, 30}));
  EXPECT_EQ(shipped::refusal("evaluate.reduction_gap", apart),
            "the surfaces of 'distal' and 'proximal' are nowhere within border_mm of each other; are they the two "
            "sides of one fracture? If so, raise border_mm");
  auto elsewhere = here;
  elsewhere.source = "atlas";
  for (const bool is_moved : {true, false}) {
    shipped::Inputs mixed = good;
    mixed["poses"] = is_moved ? both(pose(elsewhere), pose(here)) : both(pose(here), pose(elsewhere));
    EXPECT_EQ(shipped::refusal("evaluate.reduction_gap", mixed),
              "the pose is " + here.target + "_from_atlas, but the truth is " + here.target + "_from_" + here.source +
                  "; compare poses between the same two frames");
  }
}

}  // namespace two_poses_test
