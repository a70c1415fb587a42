// SPDX-License-Identifier: Apache-2.0
#include <Eigen/Eigenvalues>
#include <Eigen/LU>

#include "tests/plugins/initial/landmark_scene.hpp"

namespace marrow::test::fiducials_test {

using scene::exact_pose, scene::model, scene::seen_in;

Inputs inputs(const Landmarks& landmarks) { return {{"model", model()}, {"landmarks", item(landmarks)}}; }
Pose found(const Landmarks& landmarks, const Options& options = {}) {
  return output<Pose>("initial.fiducials", "pose", inputs(landmarks), options);
}
std::string refusal(const Landmarks& landmarks) { return shipped::refusal("initial.fiducials", inputs(landmarks)); }

TEST(Fiducials, ExactPointsGiveTheExactPose) {
  const auto points = scene::spread();
  for (const std::size_t count : {3u, 4u, 6u}) {
    const Pose pose = found(seen_in({points.begin(), points.begin() + std::ptrdiff_t(count)}, {}));
    EXPECT_LT((pose.world_from_model.rotation - exact_pose().rotation).norm(), 1e-12) << count;
    EXPECT_LT((pose.world_from_model.translation_mm - exact_pose().translation_mm).norm(), 1e-10) << count;
    EXPECT_LT(pose.cost, 1e-10);
    EXPECT_LT((pose.frame.origin_mm - Vector3d(0, 0, 50)).norm(), 1e-9) << "the model's centroid";
  }
}

TEST(Fiducials, ErrorsAreThoseOfFitzpatricksFormula) {
  // sigma = 0.4 mm in each coordinate: <FLE^2> = 0.48; <FRE^2> = (1 - 2 / N) <FLE^2>;
  // <TRE^2> = <FLE^2> / N (1 + sum over the principal axes k of d_k^2 / f_k^2, over 3).
  std::mt19937 random(3);
  std::normal_distribution<double> noise(0, 0.4);
  const auto points = scene::spread();
  const double n = double(points.size());
  const Vector3d target(5, -30, 140);
  Vector3d centre = Vector3d::Zero();
  for (const Vector3d& point : points) centre += point / n;
  Matrix3d scatter = Matrix3d::Zero();
  for (const Vector3d& point : points) scatter += (point - centre) * (point - centre).transpose() / n;
  const Eigen::SelfAdjointEigenSolver<Matrix3d> principal(scatter);
  double sum = 0;
  for (int k = 0; k < 3; ++k) {
    const double along = principal.eigenvectors().col(k).dot(target - centre);
    sum += ((target - centre).squaredNorm() - along * along) /
           (principal.eigenvalues().sum() - principal.eigenvalues()[k]);
  }
  const double formula = 0.48 / n * (1 + sum / 3);

  constexpr int kRuns = 2000;
  double fre = 0, tre = 0, predicted = 0;
  for (int run = 0; run < kRuns; ++run) {
    Landmarks landmarks = seen_in(points, {});
    for (auto& tracked : landmarks.tracked) tracked.world_mm += Vector3d(noise(random), noise(random), noise(random));
    const Pose pose = found(landmarks, {{"noise_mm", 0.4}});
    fre += pose.cost * pose.cost / kRuns;
    tre += (pose.world_from_model * target - exact_pose() * target).squaredNorm() / kRuns;
    Eigen::Matrix<double, 3, 6> by_motion;  // of the target by (r, t)
    for (int i = 0; i < 3; ++i) by_motion.col(i) = pose.frame.axes.col(i).cross(target - pose.frame.origin_mm);
    by_motion.rightCols<3>() = pose.frame.axes;
    predicted += (by_motion * *pose.covariance * by_motion.transpose()).trace() / kRuns;
  }
  EXPECT_NEAR(predicted, formula, 1e-9) << "the covariance says the same at any target";
  EXPECT_NEAR(fre, 0.48 * (1 - 2 / n), 0.02);
  EXPECT_NEAR(tre, formula, 0.06 * formula);
}

TEST(Fiducials, WithoutAGivenNoiseTheResidualsSayIt) {
  std::mt19937 random(5);
  std::normal_distribution<double> noise(0, 0.4);
  double variance = 0;
  constexpr int kRuns = 500;
  for (int run = 0; run < kRuns; ++run) {
    Landmarks landmarks = seen_in(scene::spread(), {});
    for (auto& tracked : landmarks.tracked) tracked.world_mm += Vector3d(noise(random), noise(random), noise(random));
    variance +=
        (*found(landmarks).covariance)(3, 3) / (*found(landmarks, {{"noise_mm", 1.0}}).covariance)(3, 3) / kRuns;
  }
  EXPECT_NEAR(variance, 0.16, 0.012);
}

TEST(Fiducials, NoiseOfPointsInAPlaneMakesNoReflection) {
  // Three points, and flat noise across their plane: a reflection would fit as well as the rotation.
  Landmarks landmarks = seen_in({{20, 0, 0}, {-10, 17, 0}, {-10, -17, 0}, {0, 0, 0}}, {});
  for (std::size_t i = 0; i < 4; ++i)
    landmarks.tracked[i].world_mm += exact_pose().rotation * Vector3d(0, 0, i == 3 ? 1.5 : -0.5);
  const Pose pose = found(landmarks);
  EXPECT_NEAR(pose.world_from_model.rotation.determinant(), 1, 1e-9);
  EXPECT_LT(geodesic_angle_rad(pose.world_from_model.rotation, exact_pose().rotation), 1e-6);
  EXPECT_NEAR(pose.cost, std::sqrt((3 * 0.25 + 2.25) / 4), 1e-6);
}

TEST(Fiducials, WarnsOfExchangedNames) {
  Landmarks landmarks = seen_in(scene::spread(), {});
  std::swap(landmarks.tracked[0].world_mm, landmarks.tracked[1].world_mm);
  const Pose pose = found(landmarks);
  ASSERT_EQ(pose.warnings.size(), 1u);
  EXPECT_EQ(pose.warnings[0].find("the tracked points do not fit those in the CT: they are off by "), 0u)
      << pose.warnings[0];
}

TEST(Fiducials, SaysWhatIsWrong) {
  const auto points = scene::spread();
  EXPECT_EQ(refusal(seen_in({points[0], points[1]}, {})),
            "the tracked points in the CT are 2, but a pose takes three at least");
  EXPECT_EQ(
      refusal(seen_in({{0, 0, 0}, {0, 0.1, 30}, {0, 0, 60}}, {})),
      "the tracked points in the CT lie on one line, so the rotation about it is not determined; add one aside of it");
  Landmarks landmarks = seen_in(points, {});
  landmarks.tracked[1].name = "patella";
  EXPECT_EQ(refusal(landmarks),
            "'patella' was tracked, but the landmarks have no point of that name in the CT; give its place there, or "
            "leave it out");
  landmarks = seen_in(points, {});
  for (auto& tracked : landmarks.tracked) tracked.world_mm.y() *= -1;
  EXPECT_EQ(refusal(landmarks).find("the tracked points are the mirror image of those in the CT: a reflection leaves "),
            0u)
      << refusal(landmarks);
  EXPECT_EQ(shipped::refusal("initial.fiducials", with(inputs(landmarks), {{"model", item(Mesh())}})),
            "model: the surface has no triangles");
}

}  // namespace marrow::test::fiducials_test

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
