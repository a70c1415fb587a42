// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <cmath>
#include <map>

#include "shipped.hpp"
#include "tests/framework/domain/shapes.hpp"

namespace pose_error_test {

using Eigen::AngleAxisd;
using Eigen::Vector3d;

// A shaft away from the origin with its long axis oblique in the frame's y-z plane. By the convention of FragmentFrame
// its frontal axis is +x and its lateral axis (0, 0.6, 0.8) x (1, 0, 0) = (0, 0.8, -0.6).
const Vector3d kCentre(40, -30, 250), kLong(0, 0.6, 0.8), kFrontal(1, 0, 0), kLateral(0, 0.8, -0.6);

marrow::Mesh shaft() { return marrow::test::cylinder(kCentre, kLong, 10, 100, 64); }

marrow::Truth some_truth() {
  marrow::Truth truth;
  truth.world_from_model.rotation = AngleAxisd(0.7, Vector3d(1, 2, 3).normalized()).toRotationMatrix();
  truth.world_from_model.translation_mm = Vector3d(-12, 55, 8);
  return truth;
}

/// The truth after the model itself was turned about its centre and shifted, both given in the model's frame.
marrow::Pose displaced(const marrow::Truth& truth, double angle_deg, const Vector3d& axis, const Vector3d& shift_mm) {
  const Eigen::Matrix3d turn = AngleAxisd(marrow::radians(angle_deg), axis).toRotationMatrix();
  const marrow::RigidTransform& exact = truth.world_from_model;
  marrow::Pose pose;
  pose.world_from_model.rotation = exact.rotation * turn;
  pose.world_from_model.translation_mm = exact * (kCentre - turn * kCentre + shift_mm);
  return pose;
}

shipped::Inputs inputs(const marrow::Pose& pose, const marrow::Truth& truth, const marrow::Mesh& model) {
  return {{"pose", shipped::item(pose)}, {"truth", shipped::item(truth)}, {"model", shipped::item(model)}};
}

marrow::Metrics metrics_of(const marrow::Pose& pose, const marrow::Truth& truth) {
  return shipped::call("evaluate.pose_error", inputs(pose, truth, shaft())).at("metrics").as<marrow::Metrics>();
}

std::map<std::string, double> errors(const marrow::Pose& pose, const marrow::Truth& truth) {
  std::map<std::string, double> values;
  for (const auto& item : metrics_of(pose, truth).items) values[item.name] = item.value;
  return values;
}

TEST(PoseError, IsZeroAtTheTruth) {
  for (const auto& [name, value] : errors(displaced(some_truth(), 0, kLong, Vector3d::Zero()), some_truth()))
    EXPECT_NEAR(value, 0, 1e-9) << name;
}

TEST(PoseError, AxialRotationStaysAxial) {
  auto error = errors(displaced(some_truth(), 1, kLong, Vector3d::Zero()), some_truth());
  EXPECT_NEAR(error["rotation_deg"], 1, 1e-9);
  EXPECT_NEAR(error["axial_deg"], 1, 1e-9);
  EXPECT_NEAR(error["frontal_deg"], 0, 1e-6);
  EXPECT_NEAR(error["lateral_deg"], 0, 1e-6);
  EXPECT_NEAR(error["translation_mm"], 0, 1e-9);
  EXPECT_NEAR(error["chapter_rotation_deg"], 1.0 / 3, 1e-6);
  // Chord 2 sin(0.5 deg) times the mean distance from the axis: side 2 pi 10 * 100 at 10 mm, ends 2 pi 10^2 at 20/3 mm.
  EXPECT_NEAR(error["mtre_mm"], 2 * std::sin(marrow::radians(0.5)) * (2000 * 10 + 200 * 20.0 / 3) / 2200, 1e-3);
}

TEST(PoseError, TellsFrontalFromLateral) {
  auto error = errors(displaced(some_truth(), -2, kFrontal, Vector3d::Zero()), some_truth());
  EXPECT_NEAR(error["frontal_deg"], -2, 1e-9);
  EXPECT_NEAR(error["lateral_deg"], 0, 1e-6);
  error = errors(displaced(some_truth(), 3, kLateral, Vector3d::Zero()), some_truth());
  EXPECT_NEAR(error["lateral_deg"], 3, 1e-9);
  EXPECT_NEAR(error["frontal_deg"], 0, 1e-6);
  EXPECT_NEAR(error["rotation_deg"], 3, 1e-9);
}

TEST(PoseError, TranslationIsSplitAlongAndAcrossTheShaft) {
  auto error = errors(displaced(some_truth(), 0, kLong, 3 * kFrontal - 4 * kLateral + 12 * kLong), some_truth());
  EXPECT_NEAR(error["translation_mm"], 13, 1e-9);
  EXPECT_NEAR(error["along_mm"], 12, 1e-6);
  EXPECT_NEAR(error["across_mm"], 5, 1e-6);
  EXPECT_NEAR(error["along_frontal_mm"], 3, 1e-6);
  EXPECT_NEAR(error["along_lateral_mm"], -4, 1e-6);
  EXPECT_NEAR(error["mtre_mm"], 13, 1e-9);
  EXPECT_NEAR(error["chapter_translation_mm"], (3 + 4 + 12) / 3.0, 1e-6);
  EXPECT_NEAR(error["rotation_deg"], 0, 1e-9);
}

TEST(PoseError, RotationAboutTheWorldOriginMovesTheCentroid) {
  // Turning by 1 degree about an axis 250 mm away shifts the centroid by the chord, though the rotation is the same.
  const marrow::Truth truth;
  marrow::Pose pose;
  pose.world_from_model.rotation = AngleAxisd(marrow::radians(1), Vector3d::UnitZ()).toRotationMatrix();
  auto error = errors(pose, truth);
  EXPECT_NEAR(error["rotation_deg"], 1, 1e-9);
  EXPECT_NEAR(error["translation_mm"], 2 * std::sin(marrow::radians(0.5)) * 50, 1e-6);  // hypot(40, 30) from the z axis
}

TEST(PoseError, CombinedMotion) {
  auto error = errors(displaced(some_truth(), 1.5, kLong, 2 * kLong), some_truth());
  EXPECT_NEAR(error["axial_deg"], 1.5, 1e-9);
  EXPECT_NEAR(error["along_mm"], 2, 1e-6);
  EXPECT_NEAR(error["across_mm"], 0, 1e-6);
}

TEST(PoseError, PredictedDeviationAboutTheFragmentsOwnAxes) {
  marrow::Pose pose = displaced(some_truth(), 0, kLong, Vector3d::Zero());
  pose.frame = marrow::fragment_frame(shaft());
  marrow::Vector6d variances;
  variances << 1e-6, 4e-6, 25e-6, 0.01, 0.04, 0.09;
  pose.covariance = marrow::Matrix6d(variances.asDiagonal());
  auto error = errors(pose, some_truth());
  EXPECT_NEAR(error["predicted_frontal_deg"], marrow::degrees(0.001), 1e-9);
  EXPECT_NEAR(error["predicted_lateral_deg"], marrow::degrees(0.002), 1e-9);
  EXPECT_NEAR(error["predicted_axial_deg"], marrow::degrees(0.005), 1e-9);
  EXPECT_NEAR(error["predicted_max_deg"], marrow::degrees(0.005), 1e-9);
  EXPECT_NEAR(error["predicted_along_mm"], 0.3, 1e-9);
  EXPECT_NEAR(error["predicted_max_mm"], 0.3, 1e-9);
}

TEST(PoseError, PredictionIsCarriedToTheCentroid) {
  // 1 mrad about the model frame's x axis at a point 100 mm below the centroid is 0.1 mm at the centroid.
  marrow::Pose pose = displaced(some_truth(), 0, kLong, Vector3d::Zero());
  pose.frame.origin_mm = kCentre - Vector3d(0, 0, 100);
  marrow::Matrix6d covariance = marrow::Matrix6d::Zero();
  covariance(0, 0) = 1e-6;
  pose.covariance = covariance;
  auto error = errors(pose, some_truth());
  EXPECT_NEAR(error["predicted_max_mm"], 0.1, 1e-9);
  EXPECT_NEAR(error["predicted_frontal_deg"], marrow::degrees(0.001), 1e-9);
  EXPECT_NEAR(error["predicted_along_mm"], 0.06, 1e-9);  // the shift is along -y, and the long axis has 0.6 of y
}

TEST(PoseError, NoPredictionWithoutAFiniteCovariance) {
  marrow::Pose pose = displaced(some_truth(), 0, kLong, Vector3d::Zero());
  EXPECT_EQ(errors(pose, some_truth()).count("predicted_axial_deg"), 0u);
  pose.covariance = marrow::Matrix6d::Constant(std::nan(""));
  EXPECT_EQ(errors(pose, some_truth()).count("predicted_axial_deg"), 0u);
}

TEST(PoseError, UnitsFollowTheNames) {
  for (const auto& item : metrics_of(displaced(some_truth(), 1, kLong, kLong), some_truth()).items)
    EXPECT_EQ(item.unit, item.name.substr(item.name.rfind('_') + 1)) << item.name;
}

TEST(PoseError, SaysWhatIsWrong) {
  const auto refusal = [](const marrow::Pose& pose, const marrow::Mesh& model) {
    return shipped::refusal("evaluate.pose_error", inputs(pose, {}, model));
  };
  marrow::Pose pose;
  pose.world_from_model.source = "mri";
  EXPECT_EQ(refusal(pose, shaft()),
            "the pose is world_from_mri, but the truth is world_from_ct; compare poses between the same two frames");
  marrow::Mesh model = shaft();
  model.frame = "stl";
  EXPECT_EQ(refusal({}, model),
            "the model is in the frame 'stl', but the pose takes points in 'ct'; give the model that was registered");
  pose = {};
  pose.world_from_model.translation_mm[1] = std::nan("");
  EXPECT_EQ(refusal(pose, shaft()), "pose: the transform has a number that is not finite");
  EXPECT_EQ(refusal({}, {}), "fragment frame: the surface has no triangles");
}

}  // namespace pose_error_test
