// SPDX-License-Identifier: Apache-2.0
// A flat square across the beam: how each error of the image moves it is known by hand.
#include <gtest/gtest.h>

#include "marrow/domain/camera.hpp"
#include "marrow/domain/pose.hpp"
#include "shipped.hpp"

namespace systematic_test {

using namespace marrow;

/// The borders of a square of about 40 mm, a little uneven so that they determine all six axes.
class Square : public OutlineProjector {
 public:
  std::vector<OutlinePoint> outline(const Camera& camera, const RigidTransform& pose, double) const override {
    std::vector<OutlinePoint> points;
    for (int side = 0; side < 4; ++side)
      for (int i = -5; i <= 5; ++i) {
        const double along = 4.0 * i, out = 20 + side;
        const Eigen::Vector2d normal = side == 0   ? Eigen::Vector2d(1, 0)
                                       : side == 1 ? Eigen::Vector2d(0, 1)
                                       : side == 2 ? Eigen::Vector2d(-1, 0)
                                                   : Eigen::Vector2d(0, -1);
        const Eigen::Vector3d at(out * normal.x() - along * normal.y(), out * normal.y() + along * normal.x(),
                                 3 * std::sin(7.0 * side + i));
        const Eigen::Vector3d seen = camera.camera_from_world * (pose * at);
        OutlinePoint point;
        const Eigen::Vector2d pixel = (camera.intrinsics * seen).hnormalized();
        point.u_px = float(pixel.x()), point.v_px = float(pixel.y());
        point.normal_u = float(normal.x()), point.normal_v = float(normal.y());
        point.model_mm = at.cast<float>();
        points.push_back(point);
      }
    return points;
  }
};

Pose added(double offset_px, double camera_px, double depth_percent, double opaque_mm = 0) {
  Camera camera;
  camera.width_px = camera.height_px = 512;
  camera.intrinsics << 3000, 0, 255.5, 0, 3000, 255.5, 0, 0, 1;
  List<View> views;
  views.add("only", View{"only", {cv::Mat(512, 512, CV_8U, cv::Scalar(9))}, camera, {}});
  Pose pose;
  pose.world_from_model.translation_mm = {0, 0, 1000};
  pose.covariance = Matrix6d::Zero();
  List<Pose> stages;
  stages.add("final", pose);
  const Mesh model =
      shipped::call("simulate.knee_implant", {}, {{"part", "tray"}, {"resolution_mm", 2.0}}).at("mesh").as<Mesh>();
  return shipped::call("deviations.systematic",
                       {{"stages", shipped::list(stages, "stage")},
                        {"model", shipped::item(model)},
                        {"projector", Value::of<OutlineProjector>(std::make_shared<const Square>())},
                        {"views", shipped::list(views, "view")}},
                       {{"offset_px", offset_px},
                        {"camera_px", camera_px},
                        {"camera_depth_percent", depth_percent},
                        {"opaque_mm", opaque_mm}})
      .at("pose")
      .as<Pose>();
}

// 1 pixel at 1000 mm is a third of a millimetre.
TEST(Systematic, AnImageThatIsShiftedShiftsTheBodyAcrossTheBeam) {
  const Matrix6d covariance = *added(0, 1, 0).covariance;
  EXPECT_NEAR(std::sqrt(covariance(3, 3)), 1 / 3.0, 0.03);
  EXPECT_NEAR(std::sqrt(covariance(4, 4)), 1 / 3.0, 0.03);
}

// An image that is 1 % larger is that of a body that is 1 % nearer.
TEST(Systematic, AMagnificationIsADepth) { EXPECT_NEAR(std::sqrt((*added(0, 0, 1).covariance)(5, 5)), 10, 0.3); }

TEST(Systematic, NoErrorsAddNothing) { EXPECT_EQ(added(0, 0, 0).covariance->norm(), 0); }

// The less opaque the metal may be, the farther inside its edges may lie, and the farther off the pose.
TEST(Systematic, MetalThatLetsRadiationPassIsOneMoreError) {
  const double of_steel = added(0, 0, 0, 1.5).covariance->norm(), of_titanium = added(0, 0, 0, 5).covariance->norm();
  EXPECT_GT(of_steel, 0);
  EXPECT_GT(of_titanium, of_steel);
}

}  // namespace systematic_test
