// SPDX-License-Identifier: Apache-2.0
// Calibration by a chessboard, compared with the simulated camera that photographed it. Photographs as views.
#include <gtest/gtest.h>

#include "marrow/simulate/photograph.hpp"
#include "marrow/toolbox/calibration/chessboard.hpp"
#include "shipped.hpp"
#include "tests/harness/message_of.hpp"

namespace chessboard_test {

using namespace marrow;
using namespace marrow::test;
using Eigen::Vector3d, Eigen::Vector2d;
using phantom::CameraArm;

struct Taken {
  CameraArm arm;
  List<Picture> photographs, placed;
};

const Taken& taken() {
  static const Taken made = [] {
    const Value arm = shipped::call("simulate.camera_arm", {}, {{"repeat_sd_deg", 0.0}}).at("arm");
    const auto photographed = shipped::call("simulate.chessboard", {{"arm", arm}}, {}, Context(3));
    return Taken{arm.as<CameraArm>(), photographed.at("boards").as_list<Picture>(),
                 photographed.at("placed").as_list<Picture>()};
  }();
  return made;
}

shipped::Outputs calibrated(const List<Picture>& photographs, const List<Picture>& placed,
                            const shipped::Options& options = {}) {
  return shipped::call(
      "camera.chessboard",
      {{"boards", shipped::list(photographs, "photograph")}, {"placed", shipped::list(placed, "view")}}, options);
}

std::string refusal(const List<Picture>& photographs, const List<Picture>& placed,
                    const shipped::Options& options = {}) {
  return shipped::refusal(
      "camera.chessboard",
      {{"boards", shipped::list(photographs, "photograph")}, {"placed", shipped::list(placed, "view")}}, options);
}

/// Photographs by one camera of the board at different places, always parallel to the image.
List<Picture> parallel() {
  const Value arm = shipped::call("simulate.camera_arm", {}, {{"repeat_sd_deg", 0.0}}).at("arm");
  return shipped::call("simulate.chessboard", {{"arm", arm}}, {{"tilt_deg", 0.0}}, Context(3))
      .at("boards")
      .as_list<Picture>();
}

TEST(Chessboard, BoardsThatAreNotTiltedDoNotTellTheFocalLength) {
  // A board of twice the size at twice the distance looks the same.
  const std::string text = shipped::refusal("camera.chessboard", {{"boards", shipped::list(parallel(), "photograph")}});
  EXPECT_TRUE(text.starts_with("the photographs hardly tell the focal length: it is ")) << text;
  EXPECT_TRUE(
      text.ends_with(" px (one standard deviation); take the board tilted by 20 degrees or more, to another "
                     "side in each"))
      << text;
}

Picture plain(int width = 640) { return {cv::Mat(480, width, CV_8UC3, cv::Scalar(90, 100, 110))}; }

TEST(Chessboard, CornersAreFoundInTheirOrder) {
  const calibration::Chessboard board;
  const Taken& all = taken();
  const RigidTransform world_from_board = calibration::world_from_board(board, {});
  for (std::size_t view = 0; view < all.placed.size(); ++view) {
    const Camera camera = phantom::camera_at(all.arm, all.arm.angles_deg[view]);
    const auto found = calibration::find_corners(all.placed[view], board);
    const auto corners = calibration::corners_mm(board);
    ASSERT_EQ(found.size(), corners.size());
    double squares = 0;
    Vector2d mean = Vector2d::Zero();
    for (std::size_t i = 0; i < corners.size(); ++i) {
      const Vector2d expected =
          distorted_pixel(camera.intrinsics, all.arm.device.distortion, project(camera, world_from_board * corners[i]));
      squares += (found[i] - expected).squaredNorm();
      mean += (found[i] - expected) / double(corners.size());
    }
    EXPECT_LT(std::sqrt(squares / double(corners.size())), 0.1);
    EXPECT_LT(mean.norm(), 0.05) << mean.transpose();
  }
}

TEST(Chessboard, TheKnownPlaceIsWhereItsTurnsSay) {
  // Upright, seen from -y: x to the right, y down. Turned by 90 degrees about z it is seen from +x.
  const calibration::Chessboard board{3, 4, 10};
  const RigidTransform front = calibration::world_from_board(board, {{1, 2, 3}, {-90, 0, 0}});
  EXPECT_LT((front * Vector3d(10, 15, 0) - Vector3d(1, 2, 3)).norm(), 1e-12);
  EXPECT_LT((front * Vector3d(0, 0, 0) - Vector3d(-9, 2, 18)).norm(), 1e-12);
  const RigidTransform side = calibration::world_from_board(board, {{0, 0, 0}, {-90, 0, 90}});
  EXPECT_LT((side.rotation.col(2) - Vector3d(-1, 0, 0)).norm(), 1e-12);
}

TEST(CameraChessboard, FindsTheCameraThatPhotographedTheBoard) {
  const Taken& all = taken();
  const auto found = calibrated(all.photographs, all.placed);
  const auto& calibration = found.at("calibration").as<Calibration>();
  const Calibration& truth = all.arm.device;
  for (int i : {0, 1}) {
    EXPECT_NEAR(calibration.intrinsics(i, i), truth.intrinsics(i, i), 1.5);
    EXPECT_NEAR(calibration.intrinsics(i, 2), truth.intrinsics(i, 2), 1.5);
    EXPECT_LT(std::abs(calibration.intrinsics(i, i) - truth.intrinsics(i, i)), 5 * calibration.focal_deviation_px[i]);
  }
  // The board covers up to about r = 0.45; at the corners of the image, r is 0.625.
  for (const double r : {0.2, 0.45})
    EXPECT_NEAR(800 * r * calibration.distortion.factor(r * r), 800 * r * truth.distortion.factor(r * r), 1) << r;
  EXPECT_LT(shipped::figure(found.at("metrics"), "residual"), 0.15);
  EXPECT_EQ(shipped::figure(found.at("metrics"), "photographs"), 16);
  const auto cameras = found.at("camera").as_list<Camera>();
  ASSERT_EQ(cameras.names(), all.arm.names);
  for (std::size_t i = 0; i < cameras.size(); ++i) {
    const Camera exact = phantom::camera_at(all.arm, all.arm.angles_deg[i]);
    EXPECT_LT(degrees(geodesic_angle_rad(cameras[i].camera_from_world.rotation, exact.camera_from_world.rotation)),
              0.15);
    for (const Vector3d& point : {Vector3d(0, 0, 0), Vector3d(30, 20, -80)})
      EXPECT_LT((project(cameras[i], point) - project(exact, point)).norm(), 0.5);
  }
}

TEST(CameraChessboard, LeavesOutAPhotographWithoutTheBoard) {
  List<Picture> photographs = taken().photographs;
  photographs.add("empty", plain());
  const auto found = calibrated(photographs, taken().placed);
  EXPECT_EQ(shipped::figure(found.at("metrics"), "photographs"), 16);
}

TEST(CameraChessboard, RefusesWhatItCannotUse) {
  List<Picture> two, empty, wide;
  for (std::size_t i = 0; i < 2; ++i) two.add(taken().photographs.name(i), taken().photographs[i]);
  EXPECT_EQ(refusal(two, taken().placed),
            "2 of 2 photographs show a chessboard with 9 x 6 inner corners; at least 3 are needed, and 10 are better, "
            "with the board tilted differently in each");
  empty.add("frontal", plain());
  EXPECT_EQ(
      refusal(taken().photographs, empty),
      "photograph 'frontal' does not show the whole chessboard with 9 x 6 inner corners at its known place, so the "
      "camera's place is not known");
  wide.add("frontal", plain(700));
  EXPECT_EQ(refusal(taken().photographs, wide),
            "photograph 'frontal' has 700 x 480 pixels, those before it 640 x 480; one calibration is for one size");
  EXPECT_EQ(
      refusal(two, empty, {{"rows", std::int64_t(7)}}),
      "camera.chessboard: a chessboard with 9 x 7 inner corners looks the same after half a turn; give an even and "
      "an odd number");
}

shipped::Outputs viewed(const List<Picture>& photographs, const Camera& camera, const Calibration& calibration) {
  List<Camera> cameras;
  cameras.add("frontal", camera);
  return shipped::call("camera.photographs", {{"photographs", shipped::list(photographs, "view")},
                                              {"cameras", shipped::list(cameras, "view")},
                                              {"calibration", shipped::item(calibration)}});
}

TEST(CameraPhotographs, TheLogarithmGivesTheLightWithoutDistortion) {
  // A white block before black; the sensor has a gamma. After the node, minus the logarithm is the light.
  CameraArm arm = taken().arm;
  const Camera camera = phantom::camera_at(arm, 0);
  const phantom::Painted block{
      phantom::box({"world", "box"}, {60, -1, -300}, {100, 0, 300}), {0.5, 0.5, 0.5}, 0, false};
  List<Picture> photographs;
  photographs.add("frontal",
                  phantom::photograph({block}, camera, arm.device.distortion, {{}, 1, {0, 0, 0}}, {0, 2.2, 0}, 1));
  const auto views = viewed(photographs, camera, arm.device).at("views").as_list<View>();
  ASSERT_EQ(views.size(), 1u);
  const cv::Mat1w pixels = views[0].image.pixels;
  const auto light = [&](int u, int v) { return -std::log(pixels(v, u) / 65535.0); };
  const double principal = camera.intrinsics(0, 2);
  for (const int v : {60, 240, 420}) {
    // The block's light and its left border, which is straight again: 60 * 800 / 600 = 80 px from the principal point.
    EXPECT_NEAR(light(int(principal + 105), v), 0.5, 0.01);
    EXPECT_NEAR(light(int(principal + 60), v), 0, 0.001);
    double sum = 0;
    for (int u = int(principal) + 60; u <= int(principal) + 105; ++u) sum += light(u, v);
    EXPECT_NEAR(int(principal) + 105.5 - sum / 0.5, principal + 80, 0.35) << v;
  }
}

TEST(CameraPhotographs, RefusesAPhotographWithoutACamera) {
  List<Picture> photographs;
  photographs.add("lateral", plain());
  EXPECT_EQ(message_of([&] { viewed(photographs, phantom::camera_at(taken().arm, 0), taken().arm.device); }),
            "there is no camera for photograph 'lateral'; calibrate it with the same names");
}

}  // namespace chessboard_test
