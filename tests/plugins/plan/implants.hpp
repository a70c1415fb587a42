// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "marrow/domain/camera.hpp"
#include "marrow/toolbox/geometry/implant.hpp"
#include "marrow/toolbox/phantom/phantom.hpp"
#include "tests/harness/node_test.hpp"

namespace marrow::test::implants {

/// A straight rod along z with one hole across it.
inline geometry::Implant rod() {
  geometry::Implant implant;
  implant.surface = phantom::tube({0, 0, 0}, {0, 0, 100}, 5);
  implant.surface.frame = "implant";
  implant.holes = {{"distal", {0, 0, 50}, Vector3d::UnitX(), 5}};
  return implant;
}

inline Camera camera(double alpha_deg, double beta_deg) {
  const CArm arm{512, 512, Vector2d::Constant(0.586), 1000, 600, Vector3d::Zero()};
  return carm_camera(arm, world_from_camera_rotation(radians(alpha_deg), radians(beta_deg)));
}

inline List<View> views() {
  List<View> views;
  for (const auto& [name, beta_deg] : {std::pair("frontal", 0.0), std::pair("lateral", 90.0)})
    views.add(name, view_of(name, camera(0, beta_deg), cv::Mat(512, 512, CV_16U, cv::Scalar(1000))));
  return views;
}

/// A pose that brings `model_mm` to `world_mm`, turned by a rotation vector.
inline Pose pose(const Vector3d& rotation_rad, const Vector3d& model_mm, const Vector3d& world_mm) {
  Pose pose;
  pose.world_from_model = {"world", "implant", rotation_from_vector(rotation_rad), Vector3d::Zero()};
  pose.world_from_model.translation_mm = world_mm - pose.world_from_model.rotation * model_mm;
  pose.covariance = 1e-8 * Matrix6d::Identity();
  return pose;
}

inline Inputs inputs(const geometry::Implant& implant, const Pose& pose) {
  return {{"implant", item(implant)}, {"pose", item(pose)}, {"views", shipped::list(views(), "view")}};
}

/// The options; for a left leg, if they do not say where the drill comes from.
inline Options of_left_leg(Options options) {
  if (!options.count("from") && !options.count("side")) options["side"] = std::string("left");
  return options;
}

inline Outputs locking(const geometry::Implant& implant, const Pose& pose, const Options& options = {}) {
  return call("plan.locking", inputs(implant, pose), of_left_leg(options));
}

}  // namespace marrow::test::implants
