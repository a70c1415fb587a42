// SPDX-License-Identifier: Apache-2.0
#include "tests/harness/node_test.hpp"

namespace marrow::test::pose_error_test {

using Eigen::AngleAxisd;

// A shaft away from the origin with its long axis oblique in the frame's y-z plane. By the convention of FragmentFrame
// its frontal axis is +x and its lateral axis (0, 0.6, 0.8) x (1, 0, 0) = (0, 0.8, -0.6).
const Vector3d kCentre(40, -30, 250), kLong(0, 0.6, 0.8), kFrontal(1, 0, 0), kLateral(0, 0.8, -0.6);

Mesh shaft() { return cylinder(kCentre, kLong, 10, 100, 64); }

const Truth kTruth{
    {"world", "ct", AngleAxisd(0.7, Vector3d(1, 2, 3).normalized()).toRotationMatrix(), Vector3d(-12, 55, 8)}};

/// The truth after the model itself was turned about its centre and shifted, both given in the model's frame.
Pose displaced(double angle_deg, const Vector3d& axis, const Vector3d& shift_mm = Vector3d::Zero()) {
  const Matrix3d turn = AngleAxisd(radians(angle_deg), axis).toRotationMatrix();
  const RigidTransform& exact = kTruth.world_from_model;
  return pose_of({"world", "ct", exact.rotation * turn, exact * (kCentre - turn * kCentre + shift_mm)});
}

Inputs inputs(const Pose& pose, const Truth& truth, const Mesh& model) {
  return {{"pose", item(pose)}, {"truth", item(truth)}, {"model", item(model)}};
}
Metrics metrics_of(const Pose& pose, const Truth& truth = kTruth) {
  return output<Metrics>("evaluate.pose_error", "metrics", inputs(pose, truth, shaft()));
}
Figures errors(const Pose& pose, const Truth& truth = kTruth) { return figures_of(item(metrics_of(pose, truth))); }

TEST(PoseError, IsZeroAtTheTruth) {
  for (const auto& [name, value] : errors(displaced(0, kLong))) EXPECT_NEAR(value, 0, 1e-9) << name;
}

TEST(PoseError, AxialRotationStaysAxial) {
  const Figures error = errors(displaced(1, kLong));
  expect_figures(error, {{"rotation_deg", 1}, {"axial_deg", 1}, {"translation_mm", 0}}, 1e-9);
  expect_figures(error, {{"frontal_deg", 0}, {"lateral_deg", 0}, {"chapter_rotation_deg", 1.0 / 3}}, 1e-6);
  // Chord 2 sin(0.5 deg) times the mean distance from the axis: side 2 pi 10 * 100 at 10 mm, ends 2 pi 10^2 at 20/3 mm.
  EXPECT_NEAR(error.at("mtre_mm"), 2 * std::sin(radians(0.5)) * (2000 * 10 + 200 * 20.0 / 3) / 2200, 1e-3);
}

TEST(PoseError, TellsFrontalFromLateral) {
  Figures error = errors(displaced(-2, kFrontal));
  expect_figures(error, {{"frontal_deg", -2}}, 1e-9);
  expect_figures(error, {{"lateral_deg", 0}}, 1e-6);
  error = errors(displaced(3, kLateral));
  expect_figures(error, {{"lateral_deg", 3}, {"rotation_deg", 3}}, 1e-9);
  expect_figures(error, {{"frontal_deg", 0}}, 1e-6);
}

TEST(PoseError, TranslationIsSplitAlongAndAcrossTheShaft) {
  const Figures error = errors(displaced(0, kLong, 3 * kFrontal - 4 * kLateral + 12 * kLong));
  expect_figures(error, {{"translation_mm", 13}, {"mtre_mm", 13}, {"rotation_deg", 0}}, 1e-9);
  expect_figures(error,
                 {{"along_mm", 12},
                  {"across_mm", 5},
                  {"along_frontal_mm", 3},
                  {"along_lateral_mm", -4},
                  {"chapter_translation_mm", (3 + 4 + 12) / 3.0}},
                 1e-6);
}

TEST(PoseError, RotationAboutTheWorldOriginMovesTheCentroid) {
  // Turning by 1 degree about an axis 250 mm away shifts the centroid by the chord, though the rotation is the same.
  const Figures error = errors(pose_at({0, 0, 0}, {0, 0, radians(1)}), {});
  EXPECT_NEAR(error.at("rotation_deg"), 1, 1e-9);
  EXPECT_NEAR(error.at("translation_mm"), 2 * std::sin(radians(0.5)) * 50, 1e-6);  // hypot(40, 30) from the z axis
}

TEST(PoseError, CombinedMotion) {
  const Figures error = errors(displaced(1.5, kLong, 2 * kLong));
  expect_figures(error, {{"axial_deg", 1.5}}, 1e-9);
  expect_figures(error, {{"along_mm", 2}, {"across_mm", 0}}, 1e-6);
}

TEST(PoseError, PredictedDeviationAboutTheFragmentsOwnAxes) {
  Pose pose = displaced(0, kLong);
  pose.frame = fragment_frame(shaft());
  pose.covariance = Matrix6d(Vector6d{1e-6, 4e-6, 25e-6, 0.01, 0.04, 0.09}.asDiagonal());
  expect_figures(errors(pose),
                 {{"predicted_frontal_deg", degrees(0.001)},
                  {"predicted_lateral_deg", degrees(0.002)},
                  {"predicted_axial_deg", degrees(0.005)},
                  {"predicted_max_deg", degrees(0.005)},
                  {"predicted_along_mm", 0.3},
                  {"predicted_max_mm", 0.3}},
                 1e-9);
}

TEST(PoseError, PredictionIsCarriedToTheCentroid) {
  // 1 mrad about the model frame's x axis at a point 100 mm below the centroid is 0.1 mm at the centroid.
  Pose pose = displaced(0, kLong);
  pose.frame.origin_mm = kCentre - Vector3d(0, 0, 100);
  pose.covariance = Matrix6d(Vector6d{1e-6, 0, 0, 0, 0, 0}.asDiagonal());
  // The shift is along -y, and the long axis has 0.6 of y.
  expect_figures(errors(pose),
                 {{"predicted_max_mm", 0.1}, {"predicted_frontal_deg", degrees(0.001)}, {"predicted_along_mm", 0.06}},
                 1e-9);
}

TEST(PoseError, NoPredictionWithoutAFiniteCovariance) {
  Pose pose = displaced(0, kLong);
  EXPECT_EQ(errors(pose).count("predicted_axial_deg"), 0u);
  pose.covariance = Matrix6d::Constant(std::nan(""));
  EXPECT_EQ(errors(pose).count("predicted_axial_deg"), 0u);
}

TEST(PoseError, UnitsFollowTheNames) {
  for (const auto& item : metrics_of(displaced(1, kLong, kLong)).items)
    EXPECT_EQ(item.unit, item.name.substr(item.name.rfind('_') + 1)) << item.name;
}

TEST(PoseError, SaysWhatIsWrong) {
  const auto refusal = [](const Pose& pose, const Mesh& model) {
    return shipped::refusal("evaluate.pose_error", inputs(pose, {}, model));
  };
  Pose pose;
  pose.world_from_model.source = "mri";
  EXPECT_EQ(refusal(pose, shaft()),
            "the pose is world_from_mri, but the truth is world_from_ct; compare poses between the same two frames");
  Mesh model = shaft();
  model.frame = "stl";
  EXPECT_EQ(refusal({}, model),
            "the model is in the frame 'stl', but the pose takes points in 'ct'; give the model that was registered");
  EXPECT_EQ(refusal(pose_at({0, std::nan(""), 0}), shaft()), "pose: the transform has a number that is not finite");
  EXPECT_EQ(refusal({}, {}), "fragment frame: the surface has no triangles");
}

}  // namespace marrow::test::pose_error_test
