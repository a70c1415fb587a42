// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "marrow/domain/c_arm.hpp"
#include "marrow/toolbox/geometry/implant.hpp"
#include "marrow/toolbox/geometry/locking_plan.hpp"
#include "marrow/toolbox/phantom/loft.hpp"
#include "shipped.hpp"

namespace implants {

using Eigen::Vector3d;

/// A straight rod along z with one hole across it.
inline marrow::geometry::Implant rod() {
  marrow::geometry::Implant implant;
  implant.surface = marrow::phantom::tube({0, 0, 0}, {0, 0, 100}, 5);
  implant.surface.frame = "implant";
  implant.holes = {{"distal", {0, 0, 50}, Vector3d::UnitX(), 5}};
  return implant;
}

inline marrow::Camera camera(double alpha_deg, double beta_deg) {
  const marrow::CArm arm{512, 512, Eigen::Vector2d::Constant(0.586), 1000, 600, Vector3d::Zero()};
  return marrow::carm_camera(arm,
                             marrow::world_from_camera_rotation(marrow::radians(alpha_deg), marrow::radians(beta_deg)));
}

inline marrow::List<marrow::View> views() {
  marrow::List<marrow::View> views;
  for (const auto& [name, beta_deg] : {std::pair("frontal", 0.0), std::pair("lateral", 90.0)}) {
    marrow::View view;
    view.name = name;
    view.camera = camera(0, beta_deg);
    view.image.pixels = cv::Mat(512, 512, CV_16U, cv::Scalar(1000));
    views.add(name, view);
  }
  return views;
}

/// A pose that brings `model_mm` to `world_mm`, turned by a rotation vector.
inline marrow::Pose pose(const Vector3d& rotation_rad, const Vector3d& model_mm, const Vector3d& world_mm) {
  marrow::Pose pose;
  pose.world_from_model = {"world", "implant", marrow::rotation_from_vector(rotation_rad), Vector3d::Zero()};
  pose.world_from_model.translation_mm = world_mm - pose.world_from_model.rotation * model_mm;
  pose.covariance = 1e-8 * marrow::Matrix6d::Identity();
  return pose;
}

inline shipped::Inputs inputs(const marrow::geometry::Implant& implant, const marrow::Pose& pose) {
  return {
      {"implant", shipped::item(implant)}, {"pose", shipped::item(pose)}, {"views", shipped::list(views(), "view")}};
}

/// The options; for a left leg, if they do not say where the drill comes from.
inline shipped::Options of_left_leg(shipped::Options options) {
  if (!options.count("from") && !options.count("side")) options["side"] = std::string("left");
  return options;
}

inline shipped::Outputs locking(const marrow::geometry::Implant& implant, const marrow::Pose& pose,
                                const shipped::Options& options = {}) {
  return shipped::call("plan.locking", inputs(implant, pose), of_left_leg(options));
}

}  // namespace implants
