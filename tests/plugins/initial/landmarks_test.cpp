// SPDX-License-Identifier: Apache-2.0
#include <Eigen/Cholesky>

#include "tests/plugins/initial/landmark_scene.hpp"

namespace marrow::test::landmarks_test {

using scene::exact_pose, scene::model, scene::seen_in, scene::views;

Inputs inputs(const Landmarks& landmarks) {
  return {{"model", model()}, {"landmarks", item(landmarks)}, {"views", each_view(views())}};
}
Pose found(const Landmarks& landmarks, const Options& options = {}, const Context& context = {}) {
  return output<Pose>("initial.landmarks", "pose", inputs(landmarks), options, context);
}
std::string refusal(const Landmarks& landmarks) { return shipped::refusal("initial.landmarks", inputs(landmarks)); }

/// All of one and of other landmarks.
Landmarks both(Landmarks one, const Landmarks& other) {
  one.points.insert(one.points.end(), other.points.begin(), other.points.end());
  one.seen.insert(one.seen.end(), other.seen.begin(), other.seen.end());
  return one;
}
/// Some of the six points.
std::vector<Vector3d> points_from_to(std::size_t first, std::size_t end) {
  const auto all = scene::spread();
  return {all.begin() + std::ptrdiff_t(first), all.begin() + std::ptrdiff_t(end)};
}

void expect_exact(const Pose& pose, const std::string& what) {
  EXPECT_LT(geodesic_angle_rad(pose.world_from_model.rotation, exact_pose().rotation), 1e-7) << what;
  EXPECT_LT(scene::off_mm(pose), 1e-4) << what;
  EXPECT_LT(pose.cost, 1e-5) << what;
  EXPECT_TRUE(pose.warnings.empty()) << what;
}

TEST(Landmarks, ExactPixelsGiveTheExactPose) {
  const auto points = scene::spread();
  expect_exact(found(seen_in(points, {"frontal"})), "one view");
  expect_exact(found(seen_in(points, {"frontal", "lateral"})), "two views");
  expect_exact(found(seen_in(points, {"frontal", "lateral", "oblique"})), "three views");
  expect_exact(found(seen_in(points_from_to(0, 3), {"frontal", "lateral"})), "three points in two views");
  expect_exact(found(seen_in(points_from_to(0, 4), {"frontal"})), "four points in one view");
  expect_exact(found(both(seen_in(points_from_to(0, 3), {"frontal"}), seen_in(points_from_to(3, 6), {"lateral"}))),
               "three points in the one, three others in the other");
}

TEST(Landmarks, PointsInAPlaneAreEnoughInTwoViews) {
  std::vector<Vector3d> flat;
  for (const Vector3d& point : scene::spread()) flat.emplace_back(point.x(), 0.2 * point.x(), point.z());
  expect_exact(found(seen_in(flat, {"frontal", "lateral"})), "six points in a plane");
}

TEST(Landmarks, ErrorsAreAsLargeAsPredicted) {
  for (const Strings& names : {Strings{"frontal"}, {"frontal", "lateral"}}) {
    std::mt19937 random(7);
    std::normal_distribution<double> noise(0, 1.5);
    constexpr int kRuns = 400;
    double squares = 0, costs = 0;
    Vector6d ratio = Vector6d::Zero();
    for (int run = 0; run < kRuns; ++run) {
      Landmarks landmarks = seen_in(scene::spread(), names);
      for (auto& seen : landmarks.seen) seen.pixel += Vector2d(noise(random), noise(random));
      const Pose pose = found(landmarks, {{"noise_px", 1.5}});
      const Vector6d off = motion_between(exact_pose(), pose.world_from_model, pose.frame);
      squares += off.dot(pose.covariance->ldlt().solve(off));
      ratio += off.cwiseAbs2().cwiseQuotient(pose.covariance->diagonal());
      costs += pose.cost * pose.cost;
    }
    ratio = (ratio / kRuns).cwiseSqrt();
    const double count = 6.0 * double(names.size());
    std::printf(
        "%zu views: mean squared error in units of the covariance %.2f (6 expected); by axis %.2f %.2f %.2f deg, %.2f "
        "%.2f %.2f mm of the predicted\n",
        names.size(), squares / kRuns, ratio[0], ratio[1], ratio[2], ratio[3], ratio[4], ratio[5]);
    EXPECT_NEAR(squares / kRuns, 6, 0.6) << "3.5 standard deviations of a mean of 400";
    EXPECT_NEAR(ratio.minCoeff(), 1, 0.12);
    EXPECT_NEAR(ratio.maxCoeff(), 1, 0.12);
    // Of 2 n coordinates, 6 degrees of freedom are fitted.
    EXPECT_NEAR(std::sqrt(costs / kRuns), 1.5 * std::sqrt((2 * count - 6) / count), 0.06);
  }
}

TEST(Landmarks, RefusesWhatDoesNotDetermineAPose) {
  EXPECT_EQ(refusal(seen_in(points_from_to(0, 3), {"frontal"})),
            "3 landmarks are seen in 1 view; a pose needs three that are seen in two views, or four in one");
  EXPECT_EQ(refusal(seen_in(points_from_to(0, 2), {"frontal", "lateral"})),
            "2 landmarks are seen in 2 views; a pose needs three that are seen in two views, or four in one");
  EXPECT_EQ(refusal({}),
            "0 landmarks are seen in 0 views; a pose needs three that are seen in two views, or four in one");
  EXPECT_EQ(
      refusal(seen_in({{0, 0, 0}, {1, 2, 20}, {2, 4, 40}, {3, 6, 60}}, {"frontal", "lateral"})),
      "the landmarks that are seen lie on one line, so the rotation about it is not determined; add one aside of it");
  EXPECT_EQ(refusal(both(seen_in(points_from_to(0, 2), {"frontal"}), seen_in(points_from_to(2, 4), {"lateral"}))),
            "no pose was found for the landmarks: no view shows three of them, and no three are seen in two views; "
            "mark more of them");
  Landmarks unknown = seen_in(scene::spread(), {"frontal"});
  unknown.seen[2].name = "patella";
  EXPECT_EQ(refusal(unknown),
            "view 'frontal' shows 'patella', but the landmarks have no point of that name in the CT; give its place "
            "there, or leave it out");
}

TEST(Landmarks, LeavesOutWhatOtherViewsShow) {
  Landmarks landmarks = seen_in(scene::spread(), {"frontal"});
  landmarks.seen.push_back({landmarks.points[0].name, "axial", {3, 4}});
  Heard heard;
  expect_exact(found(landmarks, {}, heard.context), "the frontal view alone");
  EXPECT_EQ(heard.warnings,
            Strings{"landmarks are seen in a view 'axial', which is none of the views; they are left out"});
}

TEST(Landmarks, RefusesAPlaneThatMayTiltToEitherSide) {
  // 6 points within 30 mm in a plane across the beam, tilted by 10 degrees: both tilts show them within a fraction of a
  // pixel.
  std::vector<Vector3d> flat;
  const Matrix3d to_beam = exact_pose().rotation.transpose() * rotation_from_vector({radians(10), 0, 0});
  for (const Vector3d& point : {Vector3d(15, 0, 15), {-15, 0, 15}, {15, 0, -15}, {-15, 0, -15}, {0, 0, 12}, {7, 0, 0}})
    flat.push_back(to_beam * point);
  const std::string said = refusal(seen_in(flat, {"frontal"}));
  EXPECT_EQ(said.find("two poses explain the landmarks: they differ by "), 0u) << said;
  EXPECT_NE(said.find("add a view, or a landmark that lies off that plane"), std::string::npos) << said;
  expect_exact(found(seen_in(flat, {"frontal", "lateral"})), "the second view tells");
}

TEST(Landmarks, RefusesTheMirrorImage) {
  Landmarks landmarks = seen_in(scene::spread(), {"frontal", "lateral"});
  for (auto& point : landmarks.points) point.model_mm.x() *= -1;
  EXPECT_EQ(refusal(landmarks).find(
                "the landmarks that two views show are the mirror image of those in the CT: a reflection leaves "),
            0u)
      << refusal(landmarks);
}

void expect_near(const Pose& pose, double most_deg, double most_mm, const std::string& what) {
  EXPECT_LT(turn_between_deg(pose.world_from_model, exact_pose()), most_deg) << what;
  EXPECT_LT(scene::off_mm(pose), most_mm) << what;
}

TEST(Landmarks, ExchangedNamesAreLeftOut) {
  Landmarks landmarks = seen_in(scene::spread(), {"frontal", "lateral"});
  std::swap(landmarks.seen[0].pixel, landmarks.seen[2].pixel);  // two names in the frontal view
  const Pose pose = found(landmarks);
  expect_near(pose, 1e-5, 1e-4, "the ten others are exact");
  ASSERT_EQ(pose.warnings.size(), 2u);
  const double apart_px = (landmarks.seen[0].pixel - landmarks.seen[2].pixel).norm();
  EXPECT_EQ(pose.warnings[0],
            "the landmark 'p(25 0 -10)' in view 'frontal' is left out: it is " + formatted("{:.3g}", apart_px) +
                " px from where the others say, and 1 px were expected; is it marked on another point?");
  EXPECT_LT(pose.cost, 1e-5) << "of those that count";
}

TEST(Landmarks, WarnsWhereAllAreOff) {
  Landmarks landmarks = seen_in(scene::spread(), {"frontal", "lateral"});
  std::mt19937 random(3);
  std::normal_distribution<double> noise(0, 15);
  for (auto& seen : landmarks.seen) seen.pixel += Vector2d(noise(random), noise(random));
  const Pose pose = found(landmarks);
  ASSERT_EQ(pose.warnings.size(), 1u) << "it is not known which are wrong";
  EXPECT_NE(pose.warnings[0].find("but 1 px were expected; are two names exchanged, or is a camera wrong?"),
            std::string::npos)
      << pose.warnings[0];
  EXPECT_GT(pose.cost, 3);
}

// Every choice of a wrong sight, and several wrong ones, each somewhere else in the image.
void expect_unspoilt(const Strings& views, std::size_t wrong_sights) {
  const Landmarks exact = seen_in(scene::spread(), views);
  std::mt19937 random(11);
  std::normal_distribution<double> noise(0, 1);
  std::uniform_real_distribution<double> anywhere(0, 511);
  int left_out = 0;
  for (std::size_t first = 0; first < exact.seen.size(); ++first) {
    Landmarks landmarks = exact;
    for (auto& seen : landmarks.seen) seen.pixel += Vector2d(noise(random), noise(random));
    for (std::size_t i = 0; i < wrong_sights; ++i) {
      auto& wrong = landmarks.seen[(first + 5 * i) % exact.seen.size()];
      const Vector2d right = wrong.pixel;
      do wrong.pixel = {anywhere(random), anywhere(random)};
      while ((wrong.pixel - right).norm() < 40);
    }
    const Pose pose = found(landmarks);
    left_out += int(pose.warnings.size());
    const Vector6d off = motion_between(exact_pose(), pose.world_from_model, pose.frame);
    EXPECT_LT(off.dot(pose.covariance->ldlt().solve(off)), 30) << "6 expected; sight " << first;
  }
  EXPECT_EQ(left_out, int(wrong_sights * exact.seen.size()));
}
TEST(Landmarks, WrongOnesDoNotSpoilThePose) {
  expect_unspoilt({"frontal", "lateral"}, 1);
  expect_unspoilt({"frontal", "lateral"}, 3);
  expect_unspoilt({"frontal", "lateral", "oblique"}, 5);
}

TEST(Landmarks, OneWrongOfSixInOneView) {
  Landmarks landmarks = seen_in(scene::spread(), {"frontal"});
  landmarks.seen[3].pixel += Vector2d(60, -45);
  const Pose pose = found(landmarks);
  expect_near(pose, 1e-4, 1e-2, "the five others are exact");
  ASSERT_EQ(pose.warnings.size(), 1u);
  EXPECT_NE(pose.warnings[0].find("is 75 px from where the others say"), std::string::npos) << pose.warnings[0];
}

// A stated deviation is the weight: two sights of one point in one view count like their weighted mean.
TEST(Landmarks, CountByTheirDeviation) {
  const Landmarks exact = seen_in(scene::spread(), {"frontal", "lateral"});
  Landmarks twice = exact, mean = exact;
  for (auto* landmarks : {&twice, &mean})
    for (auto& seen : landmarks->seen) seen.deviation_px = 2;
  // 1 px to the right with a deviation of 2 px, and 4 px to the left with 4 px: together (1/4 - 4/16) / (5/16) = 0,
  // with a deviation of 1 / sqrt(5/16) px.
  twice.seen[4].pixel.x() += 1;
  twice.seen.push_back(exact.seen[4]);
  twice.seen.back().pixel.x() -= 4;
  twice.seen.back().deviation_px = 4;
  mean.seen[4].deviation_px = 1 / std::sqrt(5.0 / 16);
  const Pose of_twice = found(twice), of_mean = found(mean);
  expect_near(of_twice, 1e-3, 1e-3, "the weighted mean is exact");
  EXPECT_LT((*of_twice.covariance - *of_mean.covariance).norm(), 1e-3 * of_mean.covariance->norm());
  // Half the deviation of all: a quarter of the covariance. Without one, noise_px counts.
  Landmarks halved = exact;
  for (auto& seen : halved.seen) seen.deviation_px = 0.5;
  EXPECT_LT((4 * *found(halved).covariance - *found(exact, {{"noise_px", 1.0}}).covariance).norm(),
            1e-9 * found(exact).covariance->norm());
  halved.seen[1].deviation_px = -1;
  EXPECT_EQ(refusal(halved),
            "the landmark 'p(25 0 -10)' in view 'lateral' has a deviation of -1 px, which must be positive, or 0 where "
            "it is not known");
}

}  // namespace marrow::test::landmarks_test
