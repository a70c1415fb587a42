// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <Eigen/LU>
#include <limits>
#include <random>

#include "tests/plugins/evaluate/listener.hpp"
#include "tests/plugins/initial/landmark_scene.hpp"

namespace skin_markers_test {

using Eigen::Vector3d;
using marrow::radians;
using scene::exact_pose, scene::model, scene::seen_in;

/// Four markers 85 mm from the long axis of scene::model(), whose centroid is at (0, 0, 50).
std::vector<Vector3d> four() { return {{85, 0, 0}, {0, 85, 100}, {-85, 0, 0}, {0, -85, 100}}; }

marrow::Pose found(const marrow::Landmarks& markers, const shipped::Options& options = {},
                   marrow::Context context = marrow::Context()) {
  return shipped::call("initial.skin_markers", {{"model", model()}, {"landmarks", shipped::item(markers)}}, options,
                       context)
      .at("pose")
      .as<marrow::Pose>();
}
std::string refusal(const marrow::Landmarks& markers, const shipped::Options& options = {}) {
  return shipped::refusal("initial.skin_markers", {{"model", model()}, {"landmarks", shipped::item(markers)}}, options);
}
shipped::Options errors(std::vector<double> noise_mm, double rotation_deg, double shift_mm) {
  return {{"noise_mm", std::move(noise_mm)}, {"common_rotation_deg", rotation_deg}, {"common_shift_mm", shift_mm}};
}

TEST(SkinMarkers, ExactMarkersGiveTheExactPose) {
  const marrow::Pose pose = found(seen_in(four(), {}));
  EXPECT_LT((pose.world_from_model.rotation - exact_pose().rotation).norm(), 1e-12);
  EXPECT_LT((pose.world_from_model.translation_mm - exact_pose().translation_mm).norm(), 1e-9);
  EXPECT_LT(pose.cost, 1e-9);
  EXPECT_TRUE(pose.warnings.empty());
}

TEST(SkinMarkers, TheCovarianceIsThatOfBothErrors) {
  // About the long axis: 3^2 / (4 85^2) of each marker by itself, and (5 degrees)^2 in common. A shift: 3^2 / 4 + 2^2.
  const marrow::Pose pose = found(seen_in(four(), {}), errors({3}, 5, 2));
  const marrow::Matrix6d& covariance = *pose.covariance;
  EXPECT_NEAR(covariance(2, 2), 9.0 / (4 * 85 * 85) + radians(5) * radians(5), 1e-9);
  for (int axis = 3; axis < 6; ++axis) EXPECT_NEAR(covariance(axis, axis), 2.25 + 4, 1e-6) << axis;
  // About an axis across: each marker's distance from it. Heights are 50 mm off the centroid, two markers 85 mm aside.
  EXPECT_NEAR(covariance(0, 0) + covariance(1, 1), 2 * 9.0 / (4 * 50 * 50 + 2 * 85 * 85), 1e-7);
  EXPECT_EQ(covariance, marrow::Matrix6d(covariance.transpose()));
}

TEST(SkinMarkers, TheCommonPartDoesNotAverageOut) {
  std::vector<Vector3d> many;
  for (int i = 0; i < 100; ++i) {
    const double angle = 2 * marrow::kPi * i / 100;
    many.emplace_back(85 * std::cos(angle), 85 * std::sin(angle), i % 2 * 100);
  }
  const marrow::Pose pose = found(seen_in(many, {}), errors({3}, 5, 0));
  EXPECT_NEAR(marrow::degrees(std::sqrt((*pose.covariance)(2, 2))), 5, 0.01);
}

TEST(SkinMarkers, AMarkerOfMoreNoiseCountsLess) {
  // The third marker is 8 mm off along the limb, where the others have noise 1: it pulls the pose by its weight only.
  const marrow::Landmarks right = seen_in(four(), {});
  marrow::Landmarks off = right;
  off.tracked[2].world_mm += exact_pose().rotation * Vector3d(0, 0, 8);
  const auto moved_mm = [&](const std::vector<double>& noise) {
    const marrow::Pose pose = found(off, errors(noise, 5, 0));
    return (pose.world_from_model * Vector3d(0, 0, 50) - exact_pose() * Vector3d(0, 0, 50)).norm();
  };
  EXPECT_GT(moved_mm({1}), 1.9);
  EXPECT_LT(moved_mm({1, 1, 100, 1}), 0.01);
}

TEST(SkinMarkers, PosesScatterAsTheCovarianceSays) {
  std::mt19937 random(7);
  std::normal_distribution<double> normal;
  const shipped::Options options = errors({2}, 5, 3);
  marrow::Matrix6d squares = marrow::Matrix6d::Zero(), predicted;
  constexpr int kRuns = 3000;
  for (int run = 0; run < kRuns; ++run) {
    marrow::Landmarks markers = seen_in(four(), {});
    marrow::Vector6d slide = marrow::Vector6d::Zero();
    slide[2] = radians(5) * normal(random);
    for (int axis = 3; axis < 6; ++axis) slide[axis] = 3 * normal(random);
    const marrow::FragmentFrame frame = found(markers, options).frame;
    const marrow::RigidTransform slid = moved(exact_pose(), frame, slide);
    for (std::size_t i = 0; i < 4; ++i)
      markers.tracked[i].world_mm =
          slid * markers.points[i].model_mm + 2 * Vector3d(normal(random), normal(random), normal(random));
    const marrow::Pose pose = found(markers, options);
    const marrow::Vector6d off = motion_between(exact_pose(), pose.world_from_model, frame);
    squares += off * off.transpose() / kRuns;
    predicted = *pose.covariance;
  }
  for (int axis = 0; axis < 6; ++axis) EXPECT_NEAR(squares(axis, axis) / predicted(axis, axis), 1, 0.1) << axis;
}

TEST(SkinMarkers, WarnsOfMarkersThatMovedAgainstEachOther) {
  marrow::Landmarks markers = seen_in(four(), {});
  markers.tracked[0].world_mm += Vector3d(30, 0, 20);
  listener::Listener listener;
  const marrow::Pose pose = found(markers, errors({2}, 5, 0), listener.context);
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
  marrow::Landmarks markers = seen_in(all, {});
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
  EXPECT_EQ(refusal(seen_in(all, {}), {{"noise_mm", std::vector<double>{1, 2}}}),
            "noise_mm has 2 numbers for 4 tracked markers; give one for all, or one for each");
  EXPECT_EQ(refusal(seen_in(all, {}), {{"noise_mm", std::vector<double>{0}}}),
            "noise_mm: each number must be positive, got 0");
}

}  // namespace skin_markers_test
