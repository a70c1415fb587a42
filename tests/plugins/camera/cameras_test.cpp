// SPDX-License-Identifier: Apache-2.0
// Cameras of a C-arm's angles and of matrices; and calibrations that determine their focal length well, hardly, or not
// at all.
#include <gtest/gtest.h>
#include <cmath>

#include "marrow/base/error.hpp"
#include "marrow/camera/determined.hpp"
#include "marrow/domain/c_arm.hpp"
#include "shipped.hpp"

namespace cameras_test {

using namespace marrow;
using Numbers = std::vector<double>;
using Eigen::Matrix3d, Eigen::Vector2d, Eigen::Vector3d;

Camera view(double alpha_deg, double beta_deg, shipped::Options options = {}) {
  options["names"] = std::vector<std::string>{"one"};
  options["alpha_deg"] = std::vector<double>{alpha_deg};
  options["beta_deg"] = std::vector<double>{beta_deg};
  return shipped::call("camera.carm", {}, options).at("camera").as_list<Camera>()[0];
}

Vector3d towards_detector(const Camera& camera) { return camera.camera_from_world.rotation.row(2); }

TEST(CarmCamera, FrontalHasDetectorInFrontHeadUpAndLooksFromTheSource) {
  const Camera frontal = view(0, 0);
  EXPECT_TRUE(towards_detector(frontal).isApprox(-Vector3d::UnitY()));
  const Vector2d centre = project(frontal, Vector3d::Zero());
  EXPECT_LT(project(frontal, {0, 0, 50}).y(), centre.y()) << "the head is up";
  EXPECT_LT(project(frontal, {50, 0, 0}).x(), centre.x()) << "seen from the source, the patient's left is on the left";
}

TEST(CarmCamera, PositiveBetaTurnsTheDetectorToThePatientsLeft) {
  EXPECT_TRUE(towards_detector(view(0, 90)).isApprox(Vector3d::UnitX()));
  EXPECT_TRUE(towards_detector(view(0, -90)).isApprox(-Vector3d::UnitX()));
  EXPECT_TRUE(towards_detector(view(0, 30)).isApprox(Vector3d(0.5, -std::sqrt(0.75), 0), 1e-12));
  // A point in front of the isocentre: as the detector goes left and the source right, its image moves to +u.
  EXPECT_GT(project(view(0, 20), {0, -50, 0}).x(), project(view(0, 0), {0, -50, 0}).x());
}

TEST(CarmCamera, PositiveAlphaTiltsTheDetectorTowardsTheHead) {
  EXPECT_TRUE(towards_detector(view(90, 0)).isApprox(Vector3d::UnitZ()));
  EXPECT_TRUE(towards_detector(view(20, 0)).isApprox(Vector3d(0, -std::cos(radians(20)), std::sin(radians(20)))));
  // The source is then towards the feet, so a point in front of the isocentre lies below the central ray: v grows.
  EXPECT_GT(project(view(20, 0), {0, -50, 0}).y(), project(view(0, 0), {0, -50, 0}).y());
}

TEST(CarmCamera, DirectionFollowsTheFormulaForBothAnglesTogether) {
  const double s = radians(25), p = radians(-40);
  const Vector3d expected(std::sin(p) * std::cos(s), -std::cos(p) * std::cos(s), std::sin(s));
  EXPECT_TRUE(towards_detector(view(25, -40)).isApprox(expected, 1e-12));
}

TEST(CarmCamera, IsocentreProjectsToTheMiddleOfTheDetectorInEveryView) {
  const Vector3d isocentre_mm(12, -7, 300);
  const shipped::Options options{{"isocentre_mm", std::vector<double>{12, -7, 300}},
                                 {"width_px", std::int64_t{1024}},
                                 {"height_px", std::int64_t{768}}};
  for (double alpha : {-30.0, 0.0, 45.0})
    for (double beta : {-120.0, 0.0, 60.0, 90.0}) {
      const Camera camera = view(alpha, beta, options);
      EXPECT_LT((project(camera, isocentre_mm) - Vector2d(511.5, 383.5)).norm(), 1e-9);
      // Isocentric: t is constant once the isocentre is the origin.
      EXPECT_TRUE((camera.camera_from_world * isocentre_mm).isApprox(Vector3d(0, 0, 600), 1e-12));
    }
}

TEST(CarmCamera, MagnificationIsDetectorDistanceOverIsocentreDistance) {
  const Camera camera = view(0, 0);
  const double shift_px = (project(camera, {0, 0, -9}) - project(camera, Vector3d::Zero())).y();
  EXPECT_NEAR(shift_px * 0.586 / 9, 1000.0 / 600.0, 1e-12);
  EXPECT_NEAR(pixel_size_at_mm(camera, Vector3d::Zero()), 0.586 * 0.6, 1e-12);
  EXPECT_TRUE(source_position_mm(camera).isApprox(Vector3d(0, 600, 0)));
}

// Eq 4, corrected: dR = R_0^T R_b2 R_a2 (R_b1 R_a1)^T R_0, which is the identity for equal poses and W_2^T W_1.
TEST(CarmCamera, RelativeMotionBetweenTwoPoses) {
  const auto relative = [](double alpha_1, double beta_1, double alpha_2, double beta_2) {
    const Camera first = view(alpha_1, beta_1), second = view(alpha_2, beta_2);
    return second.camera_from_world * inverse(first.camera_from_world);
  };
  EXPECT_TRUE(relative(17, -33, 17, -33).rotation.isIdentity(1e-12));
  EXPECT_LT(relative(17, -33, 17, -33).translation_mm.norm(), 1e-9);

  const Matrix3d w_1 = world_from_camera_rotation(radians(10), radians(20));
  const Matrix3d w_2 = world_from_camera_rotation(radians(-5), radians(110));
  const RigidTransform motion = relative(10, 20, -5, 110);
  EXPECT_TRUE(motion.rotation.isApprox(w_2.transpose() * w_1, 1e-12));
  const Vector3d c_1 = -600 * w_1.col(2), c_2 = -600 * w_2.col(2);
  EXPECT_TRUE(motion.translation_mm.isApprox(w_2.transpose() * (c_1 - c_2), 1e-12));
  EXPECT_NEAR(
      degrees(geodesic_angle_rad(view(0, 0).camera_from_world.rotation, view(0, 90).camera_from_world.rotation)), 90,
      1e-9);
}

TEST(CarmCamera, DefaultsAreTwoNamedViews) {
  const auto cameras = shipped::call("camera.carm", {}).at("camera").as_list<Camera>();
  EXPECT_EQ(cameras.names(), (std::vector<std::string>{"frontal", "lateral"}));
  EXPECT_EQ(cameras[0].width_px, 512);
}

TEST(CarmCamera, DeclaresAnglesForEachViewAndTheDetectorBehindTheIsocentre) {
  EXPECT_TRUE(shipped::declares("camera.carm", at_least_one({"names"})));
  EXPECT_TRUE(shipped::declares("camera.carm", distinct("names")));
  EXPECT_TRUE(shipped::declares("camera.carm", same_length({"names", "alpha_deg", "beta_deg"})));
  EXPECT_TRUE(shipped::declares("camera.carm", below("source_to_isocentre_mm", "source_to_detector_mm")));
}

TEST(PinholeCamera, ProjectsByEquations1To3) {
  const auto outputs = shipped::call("camera.pinhole", {},
                                     {{"width_px", std::int64_t{640}},
                                      {"height_px", std::int64_t{480}},
                                      {"intrinsics", Numbers{1000, 0, 320, 0, 500, 240, 0, 0, 1}},
                                      {"rotation", Numbers{0, -1, 0, 1, 0, 0, 0, 0, 1}},
                                      {"translation_mm", Numbers{1, 2, 100}}});
  const auto& camera = outputs.at("camera").as<Camera>();
  // x_camera = (-y + 1, x + 2, z + 100) = (-19, 12, 130)
  const Vector2d pixel = project(camera, {10, 20, 30});
  EXPECT_NEAR(pixel.x(), 1000 * -19 / 130.0 + 320, 1e-10);
  EXPECT_NEAR(pixel.y(), 500 * 12 / 130.0 + 240, 1e-10);
}

std::string message(const std::string& option, const Numbers& values) {
  return shipped::refusal("camera.pinhole", {}, {{option, values}});
}

TEST(PinholeCamera, DiagnosesWrongMatrices) {
  EXPECT_NE(message("rotation", {1, 0, 0, 0, 1, 0, 0, 0, -1}).find("not a rotation"), std::string::npos);
  EXPECT_EQ(message("intrinsics", {1706.5, 0, 255.5, 0, 1706.5, 255.5, 0, 0, 2}),
            "camera.pinhole: the camera matrix is not [f_u s u_0; 0 f_v v_0; 0 0 1], row by row");
  EXPECT_NE(message("intrinsics", {-5, 0, 255.5, 0, 1706.5, 255.5, 0, 0, 1}).find("positive focal lengths"),
            std::string::npos);
}

std::string said_of(double deviation_u_px, double deviation_v_px) {
  Calibration calibration;
  calibration.intrinsics.diagonal() << 800, 1000, 1;
  calibration.focal_deviation_px = {deviation_u_px, deviation_v_px};
  try {
    return calibration::doubtful_focal_length(calibration, "the images");
  } catch (const Error& error) {
    return std::string("refused: ") + error.what();
  }
}

TEST(FocalLength, IsDoubtfulAboveAHundredthOfItselfAndRefusedAboveATenth) {
  const std::string remedy = "; take the board tilted by 20 degrees or more, to another side in each";
  EXPECT_EQ(said_of(8, 10), "");
  EXPECT_EQ(said_of(9, 10),
            "the images hardly tell the focal length: it is 800 px, known to 9 px (one standard deviation)" + remedy);
  EXPECT_EQ(said_of(8, 101),
            "refused: the images hardly tell the focal length: it is 1000 px, known to 101 px (one standard "
            "deviation)" +
                remedy);
  EXPECT_TRUE(said_of(std::nan(""), 1).starts_with("refused: ")) << "nothing determines it";
}

}  // namespace cameras_test
