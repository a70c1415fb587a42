// SPDX-License-Identifier: Apache-2.0
// Calibration by a chessboard, compared with the simulated camera that photographed it. Photographs as views.
// The calibration from known correspondences: exact without noise, as good as the noise allows with it.

#include <cstdio>

#include "marrow/simulate/photograph.hpp"
#include "marrow/toolbox/calibration/chessboard.hpp"
#include "shipped.hpp"
#include "tests/plugins/camera/boards.hpp"
#include "tests/plugins/read/files.hpp"

namespace chessboard_test {

using namespace marrow;
using namespace marrow::test;
using calibration::CalibrationModel, calibration::CalibrationResult;
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

TEST(Calibrate, FindsTheExactDeviceWithoutNoise) {
  phantom::DeviceOptions options;
  options.principal_offset_px = {17, -11};
  const Calibration device = phantom::make_device(options);
  const auto poses = phantom::draw_board_poses(board(), {}, 5);
  const CalibrationResult fit = calibration::calibrate(test::see_board(device, poses, 0, 1), 1024, 1024, {});
  // The solver takes pixels as 32-bit numbers, which are right to 6e-5.
  EXPECT_NEAR(fit.calibration.intrinsics(0, 0), device.intrinsics(0, 0), 1e-2);
  EXPECT_NEAR(fit.calibration.intrinsics(1, 1), device.intrinsics(1, 1), 1e-2);
  EXPECT_NEAR(fit.calibration.intrinsics(0, 2), device.intrinsics(0, 2), 2e-3);
  EXPECT_NEAR(fit.calibration.intrinsics(1, 2), device.intrinsics(1, 2), 2e-3);
  EXPECT_NEAR(fit.calibration.distortion.k[0], device.distortion.k[0], 1e-3);
  EXPECT_LT(fit.calibration.residual_px, 1e-3);
  for (std::size_t i = 0; i < poses.size(); ++i) {
    EXPECT_LT(geodesic_angle_rad(fit.views[i].camera_from_world.rotation, poses[i].rotation), 1e-5);
    EXPECT_LT((fit.views[i].camera_from_world.translation_mm - poses[i].translation_mm).norm(), 1e-2);
  }
}

TEST(Calibrate, ClosedFormIsExactForADeviceWithoutDistortion) {
  phantom::DeviceOptions options;
  options.pincushion_percent = 0;
  options.principal_offset_px = {0, 0};
  const Calibration device = phantom::make_device(options);
  const auto poses = phantom::draw_board_poses(board(), {}, 2);
  const auto views = test::see_board(device, poses, 0, 1);
  for (std::size_t i = 0; i < views.size(); ++i) {
    const auto start = calibration::closed_form_camera(views[i], {511.5, 511.5});
    ASSERT_TRUE(start);
    EXPECT_FALSE(start->is_mirrored);
    EXPECT_NEAR(start->focal_px, device.intrinsics(0, 0), 1e-6);
    EXPECT_LT((start->camera_from_world.translation_mm - poses[i].translation_mm).norm(), 1e-6);
    EXPECT_LT((start->camera_from_world.rotation - poses[i].rotation).norm(), 1e-9);
  }
}

TEST(Calibrate, TellsAMirroredImage) {
  const Calibration device = phantom::make_device({});
  auto views = test::see_board(device, phantom::draw_board_poses(board(), {}, 3), 0.1, 1);
  for (auto& view : views)
    for (auto& pixel : view.pixels) pixel.x() = 1023 - pixel.x();
  EXPECT_SAYS(calibration::calibrate(views, 1024, 1024, {}),
              "view 'view1': only a mirrored image explains where the beads are seen");
}

TEST(Calibrate, OneSideAloneDoesNotDetermineACamera) {
  auto views = test::see_board(phantom::make_device({}), phantom::draw_board_poses(board(), {}, 3), 0.1, 1);
  for (auto& view : views) {
    calibration::ViewPoints front{view.name, {}, {}, {}};
    for (std::size_t i = 0; i < view.beads.size(); ++i)
      if (board().beads[std::size_t(view.beads[i])].side == 0) {
        front.board_mm.push_back(view.board_mm[i]);
        front.pixels.push_back(view.pixels[i]);
      }
    view = front;
  }
  EXPECT_SAYS(calibration::calibrate(views, 1024, 1024, {}), "do not determine a camera");
}

struct Spread {
  std::vector<double> values;
  void add(double value) { values.push_back(value); }
  double worst() const { return *std::max_element(values.begin(), values.end()); }
  double mean_of(auto what) const {
    double sum = 0;
    for (const double value : values) sum += what(value);
    return sum / double(values.size());
  }
  double root_mean_square() const {
    return std::sqrt(mean_of([](double v) { return v * v; }));
  }
  double mean() const {
    return mean_of([](double v) { return v; });
  }
  double share_below(double limit) const {
    return mean_of([&](double v) { return v <= limit ? 1 : 0; });
  }
};

// 8 views, at most 60 beads, 7 % pincushion, 0.2 px of noise on each coordinate. The limits hold for the mean (focal
// length 0.15 %, principal point 0.5 px, residual within 5 % of the noise). Noise bounds what a single run can reach,
// so the worst run is compared with the error that this noise predicts.
TEST(Calibrate, ErrorsUnderNoiseAreWhatTheNoisePredicts) {
  ASSERT_LE(board().beads.size(), 60u);
  constexpr int kSeeds = 200;
  Spread focal, principal, residual, ratio, focal_predicted, principal_predicted;
  for (int seed = 1; seed <= kSeeds; ++seed) {
    phantom::DeviceOptions options;
    std::mt19937_64 random(static_cast<unsigned>(seed));
    std::uniform_real_distribution<double> offset(-15, 15);
    options.principal_offset_px = {offset(random), offset(random)};
    const Calibration device = phantom::make_device(options);
    const auto poses = phantom::draw_board_poses(board(), {}, std::uint64_t(seed));
    const auto fit = calibration::calibrate(test::see_board(device, poses, 0.2, unsigned(1000 + seed)), 1024, 1024, {});
    const auto& found = fit.calibration;
    for (int i : {0, 1}) {
      focal.add(100 * std::abs(found.intrinsics(i, i) / device.intrinsics(i, i) - 1));
      principal.add(std::abs(found.intrinsics(i, 2) - device.intrinsics(i, 2)));
      focal_predicted.add(100 * found.focal_deviation_px[i] / device.intrinsics(i, i));
      principal_predicted.add(found.principal_deviation_px[i]);
      ratio.add((found.intrinsics(i, 2) - device.intrinsics(i, 2)) / found.principal_deviation_px[i]);
      ratio.add((found.intrinsics(i, i) - device.intrinsics(i, i)) / found.focal_deviation_px[i]);
    }
    residual.add(100 * std::abs(found.residual_px / 0.2 - 1));
  }
  std::printf("focal length: rms %.4f %%, worst %.4f %%, predicted deviation %.4f %%, within 0.15 %%: %.1f %%\n",
              focal.root_mean_square(), focal.worst(), focal_predicted.mean(), 100 * focal.share_below(0.15));
  std::printf("principal point: rms %.3f px, worst %.3f px, predicted deviation %.3f px, within 0.5 px: %.1f %%\n",
              principal.root_mean_square(), principal.worst(), principal_predicted.mean(),
              100 * principal.share_below(0.5));
  std::printf("residual against the noise: mean off %.2f %%, worst %.2f %%, within 5 %%: %.1f %%\n", residual.mean(),
              residual.worst(), 100 * residual.share_below(5));
  std::printf("error over predicted deviation: rms %.3f\n", ratio.root_mean_square());
  EXPECT_LT(focal.worst(), 0.15);
  EXPECT_LT(principal.root_mean_square(), 0.25);
  EXPECT_GT(principal.share_below(0.5), 0.97);
  EXPECT_LT(residual.mean(), 2.5);
  EXPECT_GT(residual.share_below(5), 0.9);
  EXPECT_NEAR(ratio.root_mean_square(), 1, 0.1) << "the deviations that are reported are those that occur";
}

TEST(Calibrate, DeviationsOfPosesAreThoseThatOccur) {
  const Calibration device = phantom::make_device({});
  const auto poses = phantom::draw_board_poses(board(), {}, 11);
  Spread ratio;
  for (unsigned seed = 1; seed <= 60; ++seed) {
    const auto fit = calibration::calibrate(test::see_board(device, poses, 0.2, seed), 1024, 1024,
                                            {.radial_terms = 2, .square_pixels = true, .principal_point = true});
    for (std::size_t n = 0; n < poses.size(); ++n) {
      const RigidTransform& found = fit.views[n].camera_from_world;
      const Vector3d turn = vector_from_rotation(found.rotation * poses[n].rotation.transpose());
      for (int i = 0; i < 3; ++i) {
        ratio.add(turn[i] / fit.views[n].deviation[i]);
        ratio.add((found.translation_mm - poses[n].translation_mm)[i] / fit.views[n].deviation[3 + i]);
      }
    }
  }
  EXPECT_NEAR(ratio.root_mean_square(), 1, 0.15);
}

TEST(Calibrate, SquarePixelsHaveOneFocalLengthAndOneDeviation) {
  const auto views = test::see_board(phantom::make_device({}), phantom::draw_board_poses(board(), {}, 4), 0.2, 1);
  const auto fit =
      calibration::calibrate(views, 1024, 1024, {.radial_terms = 1, .square_pixels = true, .principal_point = true});
  EXPECT_DOUBLE_EQ(fit.calibration.intrinsics(0, 0), fit.calibration.intrinsics(1, 1));
  EXPECT_GT(fit.calibration.focal_deviation_px[0], 0);
  EXPECT_EQ(fit.calibration.focal_deviation_px[1], fit.calibration.focal_deviation_px[0]);
}

// f x = u z and f y = v z, for a point at (x, y, z) in the camera's frame: the best f has no derivative left.
TEST(Calibrate, ClosedFormSolvesItsEquationsWhateverIsSeen) {
  std::mt19937_64 random(7);
  std::uniform_real_distribution<double> place_mm(-100, 100), pixel(0, 1023);
  int found = 0;
  for (int trial = 0; trial < 200; ++trial) {
    calibration::ViewPoints view{"view", {}, {}, {}};
    for (int i = 0; i < 12; ++i) {
      view.board_mm.emplace_back(place_mm(random), place_mm(random), place_mm(random));
      view.pixels.emplace_back(pixel(random), pixel(random));
    }
    const auto start = calibration::closed_form_camera(view, {511.5, 511.5});
    if (!start || start->is_mirrored) continue;
    ++found;
    double derivative = 0, squares = 0;
    for (std::size_t i = 0; i < view.board_mm.size(); ++i) {
      const Vector3d x = start->camera_from_world * view.board_mm[i];
      const Vector2d seen = view.pixels[i] - Vector2d(511.5, 511.5);
      derivative += x.head<2>().dot(start->focal_px * x.head<2>() - seen * x.z());
      squares += x.head<2>().squaredNorm() * start->focal_px;
    }
    EXPECT_LT(std::abs(derivative), 1e-6 * squares) << "trial " << trial;
  }
  EXPECT_GT(found, 10);
}

TEST(Calibrate, RefusesWithoutEnoughBeads) {
  auto views = test::see_board(phantom::make_device({}), phantom::draw_board_poses(board(), {}, 3), 0, 1);
  views[1].board_mm.resize(5);
  views[1].pixels.resize(5);
  EXPECT_SAYS(calibration::calibrate(views, 1024, 1024, {}), "view 'view2': 5 beads are seen; at least 8 are needed");
}

}  // namespace chessboard_test
