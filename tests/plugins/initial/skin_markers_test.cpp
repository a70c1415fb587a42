// SPDX-License-Identifier: Apache-2.0
#include <Eigen/LU>

#include "tests/plugins/initial/landmark_scene.hpp"

namespace marrow::test::skin_markers_test {

using scene::exact_pose, scene::model, scene::seen_in;

/// Four markers 85 mm from the long axis of scene::model(), whose centroid is at (0, 0, 50).
std::vector<Vector3d> four() { return {{85, 0, 0}, {0, 85, 100}, {-85, 0, 0}, {0, -85, 100}}; }

Inputs inputs(const Landmarks& markers) { return {{"model", model()}, {"landmarks", item(markers)}}; }
Pose found(const Landmarks& markers, const Options& options = {}, const Context& context = {}) {
  return output<Pose>("initial.skin_markers", "pose", inputs(markers), options, context);
}
std::string refusal(const Landmarks& markers, const Options& options = {}) {
  return shipped::refusal("initial.skin_markers", inputs(markers), options);
}
Options errors(Numbers noise_mm, double rotation_deg, double shift_mm) {
  return {{"noise_mm", std::move(noise_mm)}, {"common_rotation_deg", rotation_deg}, {"common_shift_mm", shift_mm}};
}

TEST(SkinMarkers, ExactMarkersGiveTheExactPose) {
  const Pose pose = found(seen_in(four(), {}));
  EXPECT_LT((pose.world_from_model.rotation - exact_pose().rotation).norm(), 1e-12);
  EXPECT_LT((pose.world_from_model.translation_mm - exact_pose().translation_mm).norm(), 1e-9);
  EXPECT_LT(pose.cost, 1e-9);
  EXPECT_TRUE(pose.warnings.empty());
}

TEST(SkinMarkers, TheCovarianceIsThatOfBothErrors) {
  // About the long axis: 3^2 / (4 85^2) of each marker by itself, and (5 degrees)^2 in common. A shift: 3^2 / 4 + 2^2.
  const Pose pose = found(seen_in(four(), {}), errors({3}, 5, 2));
  const Matrix6d& covariance = *pose.covariance;
  EXPECT_NEAR(covariance(2, 2), 9.0 / (4 * 85 * 85) + radians(5) * radians(5), 1e-9);
  for (int axis = 3; axis < 6; ++axis) EXPECT_NEAR(covariance(axis, axis), 2.25 + 4, 1e-6) << axis;
  // About an axis across: each marker's distance from it. Heights are 50 mm off the centroid, two markers 85 mm aside.
  EXPECT_NEAR(covariance(0, 0) + covariance(1, 1), 2 * 9.0 / (4 * 50 * 50 + 2 * 85 * 85), 1e-7);
  EXPECT_EQ(covariance, Matrix6d(covariance.transpose()));
}

TEST(SkinMarkers, TheCommonPartDoesNotAverageOut) {
  std::vector<Vector3d> many;
  for (int i = 0; i < 100; ++i) {
    const double angle = 2 * kPi * i / 100;
    many.emplace_back(85 * std::cos(angle), 85 * std::sin(angle), i % 2 * 100);
  }
  const Pose pose = found(seen_in(many, {}), errors({3}, 5, 0));
  EXPECT_NEAR(degrees(std::sqrt((*pose.covariance)(2, 2))), 5, 0.01);
}

TEST(SkinMarkers, AMarkerOfMoreNoiseCountsLess) {
  // The third marker is 8 mm off along the limb, where the others have noise 1: it pulls the pose by its weight only.
  const Landmarks right = seen_in(four(), {});
  Landmarks off = right;
  off.tracked[2].world_mm += exact_pose().rotation * Vector3d(0, 0, 8);
  const auto moved_mm = [&](const Numbers& noise) { return scene::off_mm(found(off, errors(noise, 5, 0))); };
  EXPECT_GT(moved_mm({1}), 1.9);
  EXPECT_LT(moved_mm({1, 1, 100, 1}), 0.01);
}

TEST(SkinMarkers, PosesScatterAsTheCovarianceSays) {
  std::mt19937 random(7);
  std::normal_distribution<double> normal;
  const Options options = errors({2}, 5, 3);
  Matrix6d squares = Matrix6d::Zero(), predicted;
  constexpr int kRuns = 3000;
  for (int run = 0; run < kRuns; ++run) {
    Landmarks markers = seen_in(four(), {});
    Vector6d slide = Vector6d::Zero();
    slide[2] = radians(5) * normal(random);
    for (int axis = 3; axis < 6; ++axis) slide[axis] = 3 * normal(random);
    const FragmentFrame frame = found(markers, options).frame;
    const RigidTransform slid = marrow::moved(exact_pose(), frame, slide);
    for (std::size_t i = 0; i < 4; ++i)
      markers.tracked[i].world_mm =
          slid * markers.points[i].model_mm + 2 * Vector3d(normal(random), normal(random), normal(random));
    const Pose pose = found(markers, options);
    const Vector6d off = motion_between(exact_pose(), pose.world_from_model, frame);
    squares += off * off.transpose() / kRuns;
    predicted = *pose.covariance;
  }
  for (int axis = 0; axis < 6; ++axis) EXPECT_NEAR(squares(axis, axis) / predicted(axis, axis), 1, 0.1) << axis;
}

TEST(SkinMarkers, WarnsOfMarkersThatMovedAgainstEachOther) {
  Landmarks markers = seen_in(four(), {});
  markers.tracked[0].world_mm += Vector3d(30, 0, 20);
  Heard listener;
  const Pose pose = found(markers, errors({2}, 5, 0), listener.context);
  ASSERT_EQ(pose.warnings.size(), 1u);
  EXPECT_EQ(listener.warnings, pose.warnings);
  EXPECT_EQ(pose.warnings[0].find("the markers have moved relative to each other: they are off by "), 0u);
  EXPECT_NE(pose.warnings[0].find("times what noise_mm says"), std::string::npos) << pose.warnings[0];
  EXPECT_NE(pose.warnings[0].find("are two names exchanged, or did a marker move?"), std::string::npos);
}

TEST(SkinMarkers, RefusesWhatGivesNoPose) {
  const std::vector<Vector3d> all = four();
  EXPECT_EQ(refusal(seen_in({all[0], all[1]}, {})), "the markers in the CT are 2, but a pose takes three at least");
  EXPECT_EQ(refusal(seen_in({{85, 0, 0}, {85, 0, 50}, {85, 0, 100}}, {})),
            "the markers in the CT lie on one line, so the rotation about it is not determined; add one aside of it");
  Landmarks markers = seen_in(all, {});
  markers.tracked[1].name = "other";
  EXPECT_EQ(refusal(markers),
            "the marker 'other' was tracked, but it has no place in the CT; give its place there, or leave it out");
  markers = seen_in(all, {});
  markers.tracked[1].name = markers.tracked[0].name = "twice";
  EXPECT_EQ(refusal(markers), "the marker 'twice' was tracked twice; each marker needs a name of its own");
  markers = seen_in(all, {});
  markers.tracked[3].name = markers.points[3].name = "unseen";
  markers.tracked[3].world_mm.y() = std::numeric_limits<double>::quiet_NaN();
  EXPECT_EQ(refusal(markers),
            "the marker 'unseen' has a coordinate that is not a number; leave out a marker that the tracking system "
            "did not see");
  EXPECT_EQ(refusal(seen_in(all, {}), {{"noise_mm", Numbers{1, 2}}}),
            "noise_mm has 2 numbers for 4 tracked markers; give one for all, or one for each");
  EXPECT_EQ(refusal(seen_in(all, {}), {{"noise_mm", Numbers{0}}}), "noise_mm: each number must be positive, got 0");
}

}  // namespace marrow::test::skin_markers_test
