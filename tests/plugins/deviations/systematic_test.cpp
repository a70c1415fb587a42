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

struct Errors {
  double offset_px = 0, camera_px = 0, depth_percent = 0, surface_mm = 0, surface_reach_mm = 10;
};

Pose added(const Errors& errors) {
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
                       {{"offset_px", errors.offset_px},
                        {"camera_px", errors.camera_px},
                        {"camera_depth_percent", errors.depth_percent},
                        {"surface_mm", errors.surface_mm},
                        {"surface_reach_mm", errors.surface_reach_mm}})
      .at("pose")
      .as<Pose>();
}

// 1 pixel at 1000 mm is a third of a millimetre.
TEST(Systematic, AnImageThatIsShiftedShiftsTheBodyAcrossTheBeam) {
  const Matrix6d covariance = *added({.camera_px = 1}).covariance;
  EXPECT_NEAR(std::sqrt(covariance(3, 3)), 1 / 3.0, 0.03);
  EXPECT_NEAR(std::sqrt(covariance(4, 4)), 1 / 3.0, 0.03);
}

// An image that is 1 % larger is that of a body that is 1 % nearer.
TEST(Systematic, AMagnificationIsADepth) {
  EXPECT_NEAR(std::sqrt((*added({.depth_percent = 1}).covariance)(5, 5)), 10, 0.3);
}

TEST(Systematic, NoErrorsAddNothing) { EXPECT_EQ(added({}).covariance->norm(), 0); }

double shift_by_surface(double reach_mm) {
  return std::sqrt((*added({.surface_mm = 1, .surface_reach_mm = reach_mm}).covariance)(3, 3));
}

// Each of the 44 points is off by itself. A turn about the beam moves a point along its normal by its distance from the
// middle of its side: -20 to 20 mm in steps of 4. The squares of all sum up to 7040 mm^2.
TEST(Systematic, ErrorsOfSinglePointsOfTheSurfaceCancel) {
  const double turn = std::sqrt((*added({.surface_mm = 1, .surface_reach_mm = 0.1}).covariance)(2, 2));
  EXPECT_NEAR(turn, 1 / std::sqrt(7040.0), 0.05 / std::sqrt(7040.0));
}

// A side as a whole is off by about the same, and the other side by itself: the middle between them by 1 / sqrt(2) mm.
TEST(Systematic, AnErrorOfAWholeSideOfTheSurfaceShiftsTheBody) {
  EXPECT_NEAR(shift_by_surface(15), 1 / std::sqrt(2.0), 0.1);
}

// A surface that is too large everywhere by the same is what the offset common to all edges takes up.
TEST(Systematic, ASurfaceThatIsTooLargeAllAroundShiftsNothing) { EXPECT_LT(shift_by_surface(1000), 0.05); }

}  // namespace systematic_test
