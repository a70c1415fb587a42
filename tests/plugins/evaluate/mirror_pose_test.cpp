// SPDX-License-Identifier: Apache-2.0
// The mirror pose of a simulated tray in one view, and of a pose with deviations that all of the outline shares.
#include <gtest/gtest.h>

#include "marrow/domain/camera.hpp"
#include "marrow/domain/pose.hpp"
#include "shipped.hpp"

namespace mirror_pose_test {

using namespace marrow;

/// A quadratic well around one pose, and a shallower one around another.
class TwoWells : public Cost {
 public:
  TwoWells(RigidTransform first, RigidTransform second, double second_value)
      : first_(first), second_(second), second_value_(second_value) {}
  double value(const RigidTransform& pose) const override {
    const auto from = [&](const RigidTransform& well) {
      return geodesic_angle_rad(pose.rotation, well.rotation) + (pose.translation_mm - well.translation_mm).norm() / 50;
    };
    return std::min(1 + from(first_), second_value_ + from(second_));
  }
  std::shared_ptr<const Cost> at_level(const CostLevel&) const override { return std::make_shared<TwoWells>(*this); }

 private:
  RigidTransform first_, second_;
  double second_value_;
};

Camera camera() {
  Camera camera;
  camera.width_px = camera.height_px = 512;
  camera.intrinsics << 3000, 0, 255.5, 0, 3000, 255.5, 0, 0, 1;
  return camera;
}

shipped::Outputs mirror_of(const RigidTransform& pose, const RigidTransform& expected, double cost) {
  const Mesh tray =
      shipped::call("simulate.knee_implant", {}, {{"part", "tray"}, {"asymmetry", 0.0}, {"resolution_mm", 1.5}})
          .at("mesh")
          .as<Mesh>();
  List<View> views;
  views.add("only", View{"only", {cv::Mat(512, 512, CV_8U, cv::Scalar(9))}, camera(), {}});
  Pose found;
  found.world_from_model = pose;
  return shipped::call("evaluate.mirror_pose",
                       {{"pose", shipped::item(found)},
                        {"cost", Value::of<Cost>(std::make_shared<const TwoWells>(pose, expected, cost))},
                        {"optimizer", shipped::call("optimizer.nelder_mead", {}).at("optimizer")},
                        {"model", shipped::item(tray)},
                        {"views", shipped::list(views, "view")}});
}

// The tray's plane of symmetry is x = 0. A turn by 12 degrees about the image's vertical axis (y) takes it out of the
// line of sight (z); seen along z at the image's middle, the mirror pose has the opposite turn.
TEST(MirrorPose, ATurnOutOfThePlaneChangesItsSign) {
  RigidTransform upright{"world", "ct"};  // z of the part up in the image
  upright.rotation = rotation_from_vector({kPi / 2, 0, 0});
  upright.translation_mm = {0, 0, 900};
  RigidTransform pose = upright, expected = upright;
  pose.rotation = rotation_from_vector({0, radians(78), 0}) * upright.rotation;
  expected.rotation = rotation_from_vector({0, radians(102), 0}) * upright.rotation;
  const auto out = mirror_of(pose, expected, 1.1);
  EXPECT_LT(degrees(geodesic_angle_rad(out.at("pose").as<Pose>().world_from_model.rotation, expected.rotation)), 1);
  double apart_deg = 0, times = 0;
  for (const Metric& one : out.at("metrics").as<Metrics>().items) {
    if (one.name == "mirror_apart_deg") apart_deg = one.value;
    if (one.name == "mirror_times") times = one.value;
  }
  EXPECT_NEAR(apart_deg, 24, 1);
  EXPECT_NEAR(times, 1.1, 0.02);
}

}  // namespace mirror_pose_test
