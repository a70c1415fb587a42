// SPDX-License-Identifier: Apache-2.0
// From images to the calibration: the beads are found and told apart, and the device is calibrated from them.

#include <opencv2/imgproc.hpp>

#include "marrow/read/camera_file.hpp"
#include "tests/plugins/camera/boards.hpp"
#include "tests/plugins/read/damage.hpp"
#include "tests/plugins/read/reading.hpp"
#include "tests/plugins/write/writing.hpp"

namespace bead_board_test {

using namespace marrow;
using namespace marrow::test;
using Eigen::Vector3d, Eigen::Vector2d;
using BeadBoard = InAFolder;
using BoardFile = InAFolder;

struct Exposed {
  calibration::Board board = calibration::read_board_file(kBoardFile);
  Calibration device;
  std::vector<RigidTransform> poses;
  List<Image> images;
};

Exposed expose(std::uint64_t seed, int views, const phantom::DeviceOptions& device = {},
               const phantom::Exposure& exposure = {}) {
  Exposed exposed;
  exposed.device = phantom::make_device(device);
  phantom::BoardPoses poses;
  poses.views = views;
  exposed.poses = phantom::draw_board_poses(exposed.board, poses, seed);
  for (std::size_t i = 0; i < exposed.poses.size(); ++i)
    exposed.images.add(
        "view" + std::to_string(i + 1),
        phantom::expose_board(exposed.board, exposed.device, exposed.poses[i], exposure, seed * 100 + i));
  return exposed;
}

/// An image of one bead whose place is known exactly.
Image one_bead(double u, double v, double diameter, double gradient) {
  cv::Mat1f grey(64, 64);
  for (int y = 0; y < 64; ++y)
    for (int x = 0; x < 64; ++x) {
      float covered = 0;
      for (int a = 0; a < 8; ++a)
        for (int b = 0; b < 8; ++b)
          covered += std::hypot(x + (a + 0.5) / 8 - 0.5 - u, y + (b + 0.5) / 8 - 0.5 - v) < diameter / 2 ? 1 / 64.f : 0;
      grey(y, x) = float(1000 + gradient * (x - u)) - 600 * covered;
    }
  cv::GaussianBlur(grey, grey, {0, 0}, 1.0);
  return {grey};
}

TEST(FindBeads, CentreIsRightToAHundredthOfAPixel) {
  for (double diameter : {5.0, 8.3, 12.0, 17.0})
    for (double off : {0.0, 0.25, 0.5, 0.8}) {
      const auto found = calibration::find_beads(one_bead(30 + off, 33 - off, diameter, 2), {24, 0.2});
      ASSERT_EQ(found.size(), 1u) << diameter;
      EXPECT_LT((found[0].centre_px - Vector2d(30 + off, 33 - off)).norm(), 0.02) << diameter << " " << off;
      EXPECT_NEAR(found[0].diameter_px, diameter, 1) << diameter;
    }
}

TEST(FindBeads, LeavesOutWhatIsNoDisc) {
  cv::Mat1f grey(200, 200, 1000.f);
  cv::circle(grey, {60, 60}, 6, 300.f, cv::FILLED, cv::LINE_AA);
  cv::rectangle(grey, {100, 40}, {140, 46}, 300.f, cv::FILLED);    // a bar
  cv::circle(grey, {60, 120}, 6, 300.f, cv::FILLED, cv::LINE_AA);  // two that merge
  cv::circle(grey, {68, 124}, 6, 300.f, cv::FILLED, cv::LINE_AA);
  cv::circle(grey, {2, 150}, 6, 300.f, cv::FILLED, cv::LINE_AA);     // cut by the border
  cv::circle(grey, {150, 150}, 40, 300.f, cv::FILLED, cv::LINE_AA);  // too large
  cv::circle(grey, {40, 180}, 6, 300.f, 2, cv::LINE_AA);             // a ring
  const auto found = calibration::find_beads({grey}, {20, 0.2});
  ASSERT_EQ(found.size(), 1u);
  EXPECT_LT((found[0].centre_px - Vector2d(60, 60)).norm(), 0.05);
  EXPECT_TRUE(calibration::find_beads({cv::Mat1f(50, 50, 7.f)}, {}).empty());
}

TEST(FindBeads, CentresInRenderedImages) {
  const Exposed exposed = expose(4, 2);
  double squares = 0, worst = 0;
  int count = 0;
  for (std::size_t n = 0; n < exposed.images.size(); ++n)
    for (const auto& found : calibration::find_beads(exposed.images[n], {})) {
      double nearest = 1e9;
      for (const auto& bead : exposed.board.beads)
        nearest = std::min(
            nearest, (phantom::image_of(exposed.device, exposed.poses[n], bead.centre_mm) - found.centre_px).norm());
      squares += nearest * nearest;
      worst = std::max(worst, nearest);
      ++count;
    }
  std::printf("%d beads found, rms %.4f px per coordinate, worst %.3f px\n", count, std::sqrt(squares / count / 2),
              worst);
  EXPECT_GT(count, 90);
  EXPECT_LT(std::sqrt(squares / count / 2), 0.1);
}

TEST(MatchBoard, EveryMatchIsRightAndFewAreMissing) {
  int expected = 0, found = 0, wrong = 0;
  for (std::uint64_t seed = 1; seed <= 5; ++seed) {
    const Exposed exposed = expose(seed, 4);
    for (std::size_t n = 0; n < exposed.images.size(); ++n) {
      const auto match =
          calibration::match_board(exposed.board, calibration::find_beads(exposed.images[n], {}), 1024, 1024, "view");
      for (std::size_t i = 0; i < match.beads.size(); ++i)
        wrong += (phantom::image_of(exposed.device, exposed.poses[n], match.board_mm[i]) - match.pixels[i]).norm() > 2;
      found += int(match.beads.size());
      for (const auto& bead : exposed.board.beads) {
        const Vector2d at = phantom::image_of(exposed.device, exposed.poses[n], bead.centre_mm);
        expected += at.x() > 10 && at.y() > 10 && at.x() < 1013 && at.y() < 1013;
      }
    }
  }
  std::printf("%d of %d beads matched, %d wrong\n", found, expected, wrong);
  EXPECT_EQ(wrong, 0);
  EXPECT_GT(found, 0.9 * expected);
}

struct Result {
  List<Camera> cameras;
  Calibration calibration;
  List<Picture> pictures;
  Metrics report;
  List<Metrics> poses;
};

Result calibrated(const List<Image>& images) {
  const auto outputs =
      shipped::call("camera.bead_board", {{"images", shipped::list(images, "view")}}, {{"board", kBoardFile.string()}});
  return {outputs.at("camera").as_list<Camera>(), outputs.at("calibration").as<Calibration>(),
          outputs.at("picture").as_list<Picture>(), outputs.at("metrics").as<Metrics>(),
          outputs.at("view_metrics").as_list<Metrics>()};
}

TEST_F(BeadBoard, DeviceFromRenderedImages) {
  double focal = 0, principal = 0, worst_residual = 0;
  for (std::uint64_t seed = 1; seed <= 3; ++seed) {
    const Exposed exposed = expose(seed, 8);
    const Result result = calibrated(exposed.images);
    const auto& found = result.calibration;
    for (int i : {0, 1}) {
      focal = std::max(focal, 100 * std::abs(found.intrinsics(i, i) / exposed.device.intrinsics(i, i) - 1));
      principal = std::max(principal, std::abs(found.intrinsics(i, 2) - exposed.device.intrinsics(i, 2)));
    }
    worst_residual = std::max(worst_residual, found.residual_px);
    EXPECT_EQ(result.cameras.names(), exposed.images.names());
    EXPECT_EQ(result.pictures.size(), 8u);
    for (std::size_t n = 0; n < 8; ++n)
      EXPECT_LT((result.cameras[n].camera_from_world.translation_mm - exposed.poses[n].translation_mm).norm(), 2);
  }
  std::printf("worst of 3 devices: focal length %.4f %%, principal point %.3f px, residual %.3f px\n", focal, principal,
              worst_residual);
  EXPECT_LT(focal, 0.15);
  EXPECT_LT(principal, 0.5);
  EXPECT_LT(worst_residual, 0.1);
}

TEST_F(BeadBoard, ImagesReadWithTheCalibrationAreThoseOfAPinhole) {
  const Exposed exposed = expose(9, 6);
  const Result result = calibrated(exposed.images);
  std::string names;
  for (const auto& item : result.report.items) names += item.name + " ";
  EXPECT_EQ(names,
            "residual worst_residual beads outliers focal_u focal_u_deviation principal_u principal_u_deviation "
            "focal_v focal_v_deviation principal_v principal_v_deviation k1 k1_deviation k2 k2_deviation k3 "
            "k3_deviation ");
  std::map<std::string, double> pose;
  for (const auto& item : result.poses[0].items) pose[item.name] = item.value;
  EXPECT_EQ(pose.size(), 8u);
  EXPECT_GT(pose.at("translation_x_deviation"), 0);
  EXPECT_LT(pose.at("translation_x_deviation") + pose.at("translation_y_deviation"), pose.at("translation_z_deviation"))
      << "depth is seen worst";
  View view{"view1", exposed.images[0], result.cameras[0], {}};
  apply_calibration(view, result.calibration);
  double worst = 0;
  int count = 0;
  for (const auto& disc : calibration::find_beads(view.image, {})) {
    double nearest = 1e9;
    for (const auto& bead : exposed.board.beads)
      nearest = std::min(nearest, (project(view.camera, bead.centre_mm) - disc.centre_px).norm());
    if (!view.mask.empty() && !view.mask.at<std::uint8_t>(int(disc.centre_px.y()), int(disc.centre_px.x()))) continue;
    worst = std::max(worst, nearest);
    ++count;
  }
  EXPECT_GT(count, 40);
  EXPECT_LT(worst, 0.15);
}

TEST_F(BeadBoard, NoisyFaintAndBlurredBeads) {
  phantom::Exposure exposure;
  exposure.photons = 60;
  exposure.attenuation_per_mm = 0.5;
  exposure.blur_px = 1.5;
  const Exposed exposed = expose(21, 6, {}, exposure);
  const Result result = calibrated(exposed.images);
  std::printf("60 photons, faint and blurred: residual %.3f px, focal length off %.4f %%, principal point %.3f px\n",
              result.calibration.residual_px,
              100 * std::abs(result.calibration.intrinsics(0, 0) / exposed.device.intrinsics(0, 0) - 1),
              (result.calibration.intrinsics - exposed.device.intrinsics).topRightCorner<2, 1>().norm());
  EXPECT_LT(result.calibration.residual_px, 0.3);
  EXPECT_NEAR(result.calibration.intrinsics(0, 0), exposed.device.intrinsics(0, 0), 5);
}

TEST_F(BeadBoard, SaysWhatIsMissing) {
  const Exposed exposed = expose(7, 3);
  List<Image> two;
  two.add("a", exposed.images[0]);
  two.add("b", exposed.images[1]);
  EXPECT_SAYS(calibrated(two), "2 images of the board are given; at least 3 are needed");
  List<Image> mixed = two;
  mixed.add("c", {cv::Mat1f(100, 100, 5.f)});
  EXPECT_SAYS(calibrated(mixed), "image 'c' has 100 x 100 pixels, 'a' 1024 x 1024");
  List<Image> blank = two;
  blank.add("c", {cv::Mat1w(1024, 1024, std::uint16_t(500))});
  EXPECT_SAYS(calibrated(blank), "view 'c': side 'lower' of the board is not found: among 0 dark discs");
  List<Image> mirrored;
  for (std::size_t n = 0; n < 3; ++n) {
    cv::Mat flipped;
    cv::flip(exposed.images[n].pixels, flipped, 1);
    mirrored.add(exposed.images.name(n), {flipped});
  }
  EXPECT_SAYS(calibrated(mirrored), "only a mirrored image explains where the beads are seen");
}

TEST_F(BeadBoard, WritesWhatReadCalibrationReads) {
  Calibration calibration;
  calibration.width_px = 640;
  calibration.height_px = 480;
  calibration.intrinsics << 1000.5, 0, 320, 0, 1000, 240, 0, 0, 1;
  calibration.distortion.k = {-0.1, 1e-9, 0};
  calibration.focal_deviation_px = {1.5, 1.25};
  calibration.principal_deviation_px = {0.1, 0.2};
  calibration.distortion_deviation = {0.01, 0.02, 0};
  calibration.residual_px = 0.21;
  writing::write(calibration, folder / "c.yaml");
  EXPECT_EQ(bytes_of(folder / "c.yaml"),
            "marrow-calibration: 1\nwidth_px: 640\nheight_px: 480\nintrinsics:\n  - [1000.5, 0, 320]\n"
            "  - [0, 1000, 240]\n  - [0, 0, 1]\nradial_distortion: [-0.1, 1e-09, 0]"
            "  # seen = (1 + k1 r^2 + k2 r^4 + k3 r^6) ideal, pixels from the principal point over the focal length\n"
            "deviation:  # one standard deviation\n  focal_px: [1.5, 1.25]\n  principal_px: [0.1, 0.2]\n"
            "  radial_distortion: [0.01, 0.02, 0]\nresidual_px: 0.21\n");
  const Calibration back = marrow::read::read_calibration_file(folder / "c.yaml");
  EXPECT_EQ(back.intrinsics, calibration.intrinsics);
  EXPECT_EQ(back.distortion.k, calibration.distortion.k);
  EXPECT_EQ(back.focal_deviation_px, calibration.focal_deviation_px);
  EXPECT_EQ(back.principal_deviation_px, calibration.principal_deviation_px);
  EXPECT_EQ(back.distortion_deviation, calibration.distortion_deviation);
  EXPECT_EQ(back.residual_px, calibration.residual_px);
}

const std::string kPlain = R"(marrow-bead-board: 1
sides:
  a:
    landmarks: {diameter_mm: 3, at_mm: [[0, 0, 0], [50, 5, 0], [60, 40, 0], [10, 50, 0]]}
    beads: {diameter_mm: 1.5, at_mm: [[20, 10, 0], [35, 22, 0], [12, 30, 0], [45, 50, 0], [25, 60, 0]]}
  b:
    landmarks: {diameter_mm: 3, at_mm: [[0, 0, 40], [40, -5, 40], [62, 45, 40], [5, 35, 40]]}
    beads: {diameter_mm: 1.5, at_mm: [[25, 10, 40], [30, 28, 40], [15, 20, 40], [50, 20, 40], [25, 55, 40]]}
)";

TEST_F(BoardFile, IsCheckedForWhatMakesBeadsFindable) {
  const auto read = [&](const std::string& text) {
    put(folder / "board.yaml", text);
    return calibration::read_board_file(folder / "board.yaml");
  };
  const calibration::Board board = read(kPlain);
  EXPECT_EQ(board.sides, (std::vector<std::string>{"a", "b"}));
  ASSERT_EQ(board.beads.size(), 18u);
  EXPECT_EQ(board.of_side(1, true).size(), 4u);
  EXPECT_TRUE(board.beads[0].landmark);
  EXPECT_EQ(board.beads[17].centre_mm, Vector3d(25, 55, 40));
  const std::string small = with_each(with_each(kPlain, "diameter_mm: 1.5", "diameter_mm: 0.8"), "_mm: 3", "_mm: 1.1");
  EXPECT_EQ(read(small).beads[0].diameter_mm, 1.1);
  expect_faults(folder / "board.yaml", kPlain,
                {{"[60, 40, 0], [10, 50, 0]]", "[60, 40, 0]]",
                  "side 'a': has 3 landmarks; a side is found in an image by at least 4"},
                 {"diameter_mm: 1.5", "diameter_mm: 2.5", "landmarks of 3 mm are not told apart from beads of 2.5 mm"},
                 {"[12, 30, 0]", "[12, 30, 8]", "out of the side's plane, at most 1 mm expected"},
                 {"[12, 30, 0]", "[12, 30]",
                  "board.yaml:5:65: side 'a': beads: at_mm: expected a point [x, y, z] in mm, got a list of 2"},
                 {"[12, 30, 0]", "[20, 10.2, 0]", "beads 5 and 7 (counted as the file lists them) overlap"},
                 {"sides:", "side:", "board: unknown key 'side'; did you mean 'sides'?"},
                 {"", with_each(kPlain, ", 40]", ", 5]"), "the two sides are 5 mm apart; at least 10 mm are needed"}},
                calibration::read_board_file);
}

TEST_F(BoardFile, RefusesBoardsThatLookAlikeWhenTurned) {
  std::string text = "marrow-bead-board: 1\nsides:\n";
  for (const auto& [name, z] : std::map<std::string, int>{{"a", 0}, {"b", 40}}) {
    text += "  " + name + ":\n    landmarks: {diameter_mm: 3, at_mm: [";
    for (const char* p : {"-40, -40", "40, -40", "40, 40", "-40, 40"})
      text += std::string(text.back() == '[' ? "" : ", ") + "[" + p + ", " + std::to_string(z) + "]";
    text += "]}\n    beads: {diameter_mm: 1.5, at_mm: [";
    for (int x : {-20, 0, 20})
      for (int y : {-20, 0, 20})
        text += std::string(text.back() == '[' ? "" : ", ") + "[" + std::to_string(x) + ", " + std::to_string(y) +
                ", " + std::to_string(z) + "]";
    text += "]}\n";
  }
  put(folder / "board.yaml", text);
  EXPECT_SAYS(calibration::read_board_file(folder / "board.yaml"),
              "side 'a' looks the same when it is turned or mirrored");
  const std::size_t first = kPlain.find("  a:"), second = kPlain.find("  b:");
  const std::string side = kPlain.substr(first, second - first);
  put(folder / "board.yaml", kPlain.substr(0, second) + with_each(with(side, "  a:", "  b:"), ", 0]", ", 40]"));
  EXPECT_SAYS(calibration::read_board_file(folder / "board.yaml"), "the two sides look the same");
}

}  // namespace bead_board_test
