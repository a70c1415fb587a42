// SPDX-License-Identifier: Apache-2.0
// No image shows an error that all cameras share, so the poses are as uncertain as the options say.
#include <marrow/domain/random.hpp>

#include "split.hpp"

namespace marrow::test::refine_cameras_test {

/// The error of a pose in degrees and mm, and its covariance in these units.
struct Outcome {
  Vector6d error;
  Matrix6d covariance;
  double distance2() const { return error.dot(inverse_of_symmetric(covariance) * error); }
  double deviations(int i) const { return std::abs(error[i]) / std::sqrt(covariance(i, i)); }
};

Outcome outcome(const Bone& bone, const Options& options = {}) {
  const Pose found = output_list<Pose>("refine.cameras", "poses", inputs({bone}), options)[0];
  Vector6d unit = Vector6d::Ones();
  unit.head<3>() *= degrees(1);
  return {well::way(bone.pose.world_from_model, found.world_from_model, found.frame),
          unit.asDiagonal() * *found.covariance * unit.asDiagonal()};
}

TEST(RefineCameras, AMotionThatBothCamerasShareIsAsLargeAsTheOptionsSay) {
  // With exact images, only the shared motion is not known. Its inverse covariance is the sum of both cameras' own:
  // with numpy, of each camera C^-1 turned into the world's axes, the sum inverted and turned into the bone's. C is the
  // sum of 0.5 / sqrt(3) degrees about each axis, 1 / sqrt(3) mm along each, 0.01 z along the depth, and 5 / sqrt(2) px
  // of the principal point along u and v, which turn the bone about the source; a tenth of these 5 px is added to the
  // degrees and mm. z is the depth of the bone (602.602 and 591.405 mm).
  const std::array<double, 6> expected{0.21255667, 0.21619969, 0.20960736, 1.26303855, 1.0507536, 1.24958536};
  const RigidTransform off = motion({0.2, 0.2, -0.2}, {1, 1, 1});
  const Outcome found = outcome(Bone({off, off}, 1e6));
  EXPECT_GT(found.error.tail<3>().norm(), 1.4) << "no image can show it";
  for (int i = 0; i < 6; ++i)
    EXPECT_NEAR(std::sqrt(found.covariance(i, i)), expected[std::size_t(i)], 0.01 * expected[std::size_t(i)]) << i;
  EXPECT_LT(found.distance2(), 12.6) << "19 of 20 poses lie within (chi-squared, 6)";
}

TEST(RefineCameras, WhatIsSharedGoesByTheReference) {
  const RigidTransform off = motion({0.2, 0.2, -0.2}, {1, 1, 1});
  const Outcome found = outcome(Bone({off, off}, 1e6), {{"reference_view", std::string("frontal")}});
  // The reference counts as right, so the bone follows it. It would be very unlikely that the other camera is off as
  // much.
  EXPECT_LT(std::sqrt(found.covariance.diagonal().maxCoeff()), 0.075);  // 0.2 px of the outline are 0.07 mm
}

TEST(RefineCameras, ErrorsOfCamerasDrawnAsTheOptionsSayAreAsLargeAsPredicted) {
  // Each camera's motion is drawn from the deviations that the options stand for, and the pose that each view likes
  // best from the noise of its image. The predicted covariance must then hold for the poses found.
  constexpr int kDraws = 100;
  constexpr double kInformation = 20;  // in each view; doubled noise makes 10 of it
  Random random(8);
  double sum = 0;
  int above_3 = 0, within_1 = 0;
  for (int draw = 0; draw < kDraws; ++draw) {
    Bone bone({});
    std::vector<RigidTransform> best;
    for (std::size_t v = 0; v < 2; ++v) {
      const Camera& camera = views()[v].camera;
      const Vector3d centre = bone.pose.world_from_model * bone.pose.frame.origin_mm;
      const double depth = (camera.camera_from_world * centre).z(), turn = 0.5 / std::sqrt(3.0),
                   across = std::sqrt(1 / 3.0 + 12.5 * std::pow(depth / 1700, 2)),
                   along = std::sqrt(1 / 3.0 + std::pow(0.01 * depth, 2));
      Vector6d drawn, noise;
      for (double& one : drawn) one = random.normal();
      for (double& one : noise) one = random.normal() / std::sqrt(0.5 * kInformation);
      const Matrix3d axes = camera.camera_from_world.rotation.transpose();
      RigidTransform off{"world", "world"};
      off.rotation = rotation_from_vector(radians(turn) * axes * drawn.head<3>());
      off.translation_mm =
          centre - off.rotation * centre + axes * drawn.tail<3>().cwiseProduct(Vector3d(across, across, along));
      Pose seen = bone.pose;
      seen.world_from_model = off * bone.pose.world_from_model;
      best.push_back(well::pose_at(seen, noise[0], noise[1], noise[2], noise[3], noise[4], noise[5]).world_from_model);
    }
    bone.cost = std::make_shared<Split>(best, bone.pose.frame, kInformation);
    const Outcome found = outcome(bone);
    sum += found.distance2() / kDraws;
    for (int i = 0; i < 6; ++i) above_3 += found.deviations(i) > 3, within_1 += found.deviations(i) < 1;
  }
  EXPECT_NEAR(sum, 6, 3 * std::sqrt(12.0 / kDraws)) << "the mean of chi-squared with 6 degrees of freedom";
  EXPECT_LE(above_3, 6) << "of 600; 2 are expected";
  EXPECT_NEAR(within_1 / (6.0 * kDraws), 0.683, 0.05);
}

}  // namespace marrow::test::refine_cameras_test
