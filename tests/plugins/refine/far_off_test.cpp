// SPDX-License-Identifier: Apache-2.0
// Cameras that may be far off: the search that comes first, what is stated about each camera, and what the images tell.
#include <marrow/domain/random.hpp>

#include "marrow/toolbox/geometry/camera_deviations.hpp"
#include "split.hpp"

namespace marrow::test::refine_cameras_test {

/// Like Split, but flat from some mm and degrees on, as a contour is beyond its reach. The reach is in px, and a pixel
/// is 600 / 1700 mm at the bone.
class WithinReach : public Split {
 public:
  WithinReach(const std::vector<RigidTransform>& best, const FragmentFrame& frame, double reach_px)
      : Split(best, frame, 1e4), reach2_(std::pow(reach_px * 600 / 1700, 2)) {}
  double value_in_view(std::size_t view, const RigidTransform& pose) const override {
    const double full = Split::value_in_view(view, pose);
    return full / (1 + full / reach2_);
  }
  double value(const RigidTransform& pose) const override {
    return 0.5 * (value_in_view(0, pose) + value_in_view(1, pose));
  }
  std::shared_ptr<const Cost> at_level(const CostLevel& level) const override {
    auto cost = std::make_shared<WithinReach>(*this);
    cost->reach2_ = std::pow(level.reach_px * 600 / 1700, 2);
    return cost;
  }

 private:
  double reach2_;
};

/// What both cameras show if the principal points are off by (70, -50) and (-60, 40) px and the second focal length by
/// 8
/// %: the bone turned about the source by the angle of the ray.
Bone far_off() {
  const auto seen_in = [](std::size_t view, double u_px, double v_px, double depth_mm) {
    const RigidTransform world_from_camera = inverse(views()[view].camera.camera_from_world);
    RigidTransform in_camera{"camera", "camera"};
    in_camera.rotation = rotation_from_vector(Vector3d(-v_px, u_px, 0) / 1700);
    in_camera.translation_mm = Vector3d(0, 0, depth_mm);
    return world_from_camera * in_camera * views()[view].camera.camera_from_world;
  };
  Bone bone({seen_in(0, 70, -50, 0), seen_in(1, -60, 40, -48)});
  std::vector<RigidTransform> best{seen_in(0, 70, -50, 0) * bone.pose.world_from_model,
                                   seen_in(1, -60, 40, -48) * bone.pose.world_from_model};
  bone.cost = std::make_shared<WithinReach>(best, bone.pose.frame, 6);
  return bone;
}

/// How far the pose that each corrected camera shows is from the one that its image likes best.
double worst_cost(const Bone& bone, const Outputs& outputs) {
  const RigidTransform pose = outputs.at("poses").as_list<Pose>()[0].world_from_model;
  return std::max(bone.cost->value_in_view(0, found(outputs, 0) * pose),
                  bone.cost->value_in_view(1, found(outputs, 1) * pose));
}

TEST(RefineCamerasThatAreFarOff, AreFoundWhereSoMuchIsExpected) {
  const Bone bone = far_off();
  EXPECT_GT(worst_cost(bone, call("refine.cameras", inputs({bone}))), 1) << "expected: 5 px and 1 %";
  const auto outputs = call("refine.cameras", inputs({bone}),
                            {{"focal_percent", 5.0}, {"centre_px", 60.0}, {"turn_deg", 0.01}, {"shift_mm", 0.01}});
  EXPECT_LT(worst_cost(bone, outputs), 1e-3);
  const Pose pose = outputs.at("poses").as_list<Pose>()[0];
  const Vector6d way = well::way(bone.pose.world_from_model, pose.world_from_model, pose.frame);
  for (int i = 3; i < 6; ++i)
    EXPECT_LT(std::abs(way[i]), 3 * std::sqrt((*pose.covariance)(i, i))) << "the pose is as uncertain as the cameras";
}

/// The same for what a camera file says.
Inputs with_stated(Inputs inputs, const geometry::CameraDeviations& stated,
                   const Strings& names = {"frontal", "lateral"}) {
  List<geometry::CameraDeviations> list;
  for (const std::string& name : names) list.add(name, stated);
  inputs.emplace("camera_deviations", shipped::list(list, "view"));
  return inputs;
}

TEST(RefineCamerasThatAreFarOff, WhatIsStatedTakesThePlaceOfTheOptions) {
  const Bone bone = far_off();
  geometry::CameraDeviations stated;
  stated.focal_percent = 5, stated.centre_px = 60, stated.turn_deg = 0.01, stated.shift_mm = 0.01;
  const auto outputs = call("refine.cameras", with_stated(inputs({bone}), stated));
  EXPECT_LT(worst_cost(bone, outputs), 1e-3);
  const auto by_options = call("refine.cameras", inputs({bone}),
                               {{"focal_percent", 5.0}, {"centre_px", 60.0}, {"turn_deg", 0.01}, {"shift_mm", 0.01}});
  EXPECT_EQ(*outputs.at("poses").as_list<Pose>()[0].covariance, *by_options.at("poses").as_list<Pose>()[0].covariance);
}

TEST(RefineCamerasThatAreFarOff, SaysOfWhichParametersItKnowsMore) {
  Heard heard;
  const auto outputs = call("refine.cameras", inputs({Bone({kNone, motion({0, 0, 0}, {-6, 0, 0})}, 1e6)}),
                            {{"reference_view", std::string("frontal")}}, heard.context);
  // The lateral camera sees the bone 6 mm farther away, 1 % of its depth: x of the world is its depth, and turned over.
  // Of a shift of 1 / sqrt(3) mm and 1 % of 600 mm, the focal length explains 36 / (36 + 1 / 3), so it is too long.
  EXPECT_NEAR(std::abs(figure(motions(outputs, 1), "shift_depth_mm")), 6, 0.05);
  EXPECT_NEAR(figure(motions(outputs, 1), "focal_percent") * figure(motions(outputs, 1), "shift_depth_mm"),
              -6.0 * 6 / 5.914 / (1 + 1 / (3 * 35.0)), 0.1);
  EXPECT_GT(figure(motions(outputs, 1), "determined_focal"), 98);
  EXPECT_GT(figure(motions(outputs, 1), "predicted_focal_percent"), 0.09) << "a shift of the camera shows the same";
  EXPECT_TRUE(std::any_of(heard.lines.begin(), heard.lines.end(), [](const std::string& line) {
    return line.starts_with("view 'lateral': the images determine its camera's ") &&
           line.find("focal length (99 %)") != std::string::npos;
  }));
}

TEST(RefineCamerasThatAreFarOff, SaysWhatIsWrong) {
  EXPECT_EQ(refusal("refine.cameras", with_stated(inputs({Bone({kNone, kNone})}), {}, {"lateral", "frontal"})),
            "camera_deviations and views are not of the same views; wire both from the node that reads the views");
  auto other = inputs({Bone({kNone, kNone})});
  other["coarse_costs"] = inputs({Bone({kNone, kNone}), Bone({kNone, kNone})})["costs"];
  EXPECT_EQ(refusal("refine.cameras", other),
            "coarse_costs and costs are not of the same bones; wire both from nodes that are called for each fragment");
  other["coarse_costs"] = inputs({Bone({kNone, kNone, kNone})})["costs"];
  EXPECT_EQ(refusal("refine.cameras", other),
            "the coarse cost of 'distal' compares 3 views, but there are 2; make it of the same views");
}

// No image shows an error that all cameras share, so the poses are as uncertain as the options say.

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
