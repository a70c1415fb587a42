// SPDX-License-Identifier: Apache-2.0
// How far two poses are apart, and what a reduction by two found poses leaves open.
#include "tests/harness/node_test.hpp"

namespace marrow::test::two_poses_test {

/// A bar of 20 x 20 x 100 mm, sawn through at its middle.
const Mesh kLower = box({0, 0, -25}, {20, 20, 50}), kUpper = box({0, 0, 25}, {20, 20, 50});

TEST(PoseDifference, OfATurnAndAShift) {
  const auto metrics = call("evaluate.pose_difference", {{"pose", item(pose_at({0, 0, -5}, {0, 0, radians(10)}))},
                                                         {"reference", item(Pose())},
                                                         {"model", item(kLower)}})
                           .at("metrics");
  // What holds for one point by hand holds for all points of the surface: how far a point turns depends on its distance
  // from the axis.
  double sum = 0;
  for (const Vector3d& point : sample_surface(kLower, 500))
    sum += std::hypot(5.0, 2 * std::sin(radians(5)) * point.head<2>().norm()) / 500;
  EXPECT_GT(sum, 5);
  EXPECT_LT(sum, std::hypot(5.0, radians(10) * 15));
  expect_figures(metrics,
                 {{"rotation_deg", 10},
                  {"axial_deg", 10},
                  {"frontal_deg", 0},
                  {"lateral_deg", 0},
                  {"translation_mm", 5},
                  {"x_mm", 0},
                  {"y_mm", 0},
                  {"z_mm", -5},
                  {"distance_mm", sum}},
                 1e-9);
}

TEST(PoseDifference, RefusesPosesOfOtherFrames) {
  Pose other;
  other.world_from_model.source = "mri";
  EXPECT_EQ(
      refusal("evaluate.pose_difference",
              {{"pose", item(Pose())}, {"reference", item(other)}, {"model", item(kLower)}}),
      "the pose is world_from_ct, but the reference is world_from_mri; compare poses between the same two frames");
}

template <class T>
Value both(const T& lower, const T& upper) {
  return per_fragment("distal", lower, "proximal", upper);
}

/// The lower half is found at one place and lies at another. The upper one is found where it lies.
Inputs halves(const RigidTransform& found, const RigidTransform& truth,
              const RigidTransform& upper = placed({0, 0, 0})) {
  return {{"poses", both(pose_of(found), pose_of(upper))},
          {"truths", both(Truth{truth}, Truth{upper})},
          {"models", both(kLower, kUpper)}};
}
Value gap(const Inputs& inputs, const Options& options = {}) {
  return call("evaluate.reduction_gap", inputs, options).at("metrics");
}

// The lower half truly lies 8 mm to the side and is found there: the reduction closes the gap.
TEST(ReductionGap, ExactPosesCloseIt) {
  const auto metrics = gap(halves(placed({8, 0, 0}), placed({8, 0, 0}), placed({5, 5, 5}, {0, 0, 0.3})));
  EXPECT_GT(figure(metrics, "before_mm"), 5);
  expect_figures(metrics, {{"gap_mm", 0}, {"largest_gap_mm", 0}}, 1e-9);
  expect_figures(metrics, {{"rotation_deg", 0}}, 1e-5);
}

// Found 0.5 mm too high: the reduction leaves it 0.5 mm too low, all over.
TEST(ReductionGap, AnErrorOfAPoseStaysOpen) {
  expect_figures(gap(halves(placed({8, 0, 0.5}), placed({8, 0, 0}))),
                 {{"before_mm", 8}, {"gap_mm", 0.5}, {"largest_gap_mm", 0.5}, {"translation_mm", 0.5}}, 1e-9);
}

// Found turned by 2 degrees about x through the fracture. The gap that stays open is this turn of the fracture's
// points, which lie up to 10 mm to the side and, on the walls, up to border_mm below the cut.
TEST(ReductionGap, OfATurnIsWhatTheFractureShows) {
  for (const double border_mm : {3.0, 8.0}) {
    const auto metrics =
        gap(halves(placed({0, 0, 0}, {radians(2), 0, 0}), placed({0, 0, 0})), {{"border_mm", border_mm}});
    const double turn = 2 * std::sin(radians(1));
    expect_figures(metrics, {{"rotation_deg", 2}, {"before_mm", 0}}, 1e-9);
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
  const std::string node = "evaluate.reduction_gap";
  const Inputs good = halves(placed({0, 0, 0}), placed({0, 0, 0}));
  EXPECT_EQ(refusal(node, good, {{"moved", std::string("middle")}}),
            "there is no pose of a fragment 'middle', only of distal, proximal; name both fragments with moved and "
            "reference");
  EXPECT_EQ(refusal(node, with(good, {{"models", both(kLower, box({0, 0, 35}, {20, 20, 30}))}})),
            "the surfaces of 'distal' and 'proximal' are nowhere within border_mm of each other; are they the two "
            "sides of one fracture? If so, raise border_mm");
  Pose elsewhere;
  elsewhere.world_from_model.source = "atlas";
  for (const Value& poses : {both(elsewhere, Pose()), both(Pose(), elsewhere)})
    EXPECT_EQ(
        refusal(node, with(good, {{"poses", poses}})),
        "the pose is world_from_atlas, but the truth is world_from_ct; compare poses between the same two frames");
}

}  // namespace marrow::test::two_poses_test
