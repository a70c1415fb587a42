// SPDX-License-Identifier: Apache-2.0
#include <Eigen/Eigenvalues>

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
