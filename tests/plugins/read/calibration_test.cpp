// SPDX-License-Identifier: Apache-2.0
// The distortion of an image is removed once, when its view is read.
#include "marrow/read/calibration_file.hpp"

#include <opencv2/core.hpp>

#include "tests/plugins/read/files.hpp"
#include "tests/plugins/read/itk_files.hpp"
#include "tests/plugins/read/reading.hpp"

namespace calibration_test {

using namespace marrow;
using namespace marrow::test;
using Eigen::Vector2d, Eigen::Matrix3d;

constexpr int kWidth = 200, kHeight = 160;

Matrix3d intrinsics() {
  Matrix3d k;
  k << 650, 0, 104, 0, 640, 77, 0, 0, 1;
  return k;
}

const RadialDistortion kPincushion{{3, 10, 0}};

/// Grey values that vary smoothly over the undistorted image.
double pattern(const Vector2d& pixel) {
  return 128 + 50 * std::sin(0.11 * pixel.x()) + 50 * std::cos(0.13 * pixel.y());
}

/// The pattern as the device sees it. The ideal place of each pixel is found by a search, so only the forward model of
/// the tested code is used.
cv::Mat1f as_taken() {
  cv::Mat1f image(kHeight, kWidth);
  for (int v = 0; v < kHeight; ++v)
    for (int u = 0; u < kWidth; ++u) {
      const Vector2d seen(u, v);
      Vector2d ideal = seen;
      for (int i = 0; i < 60; ++i) ideal += seen - distorted_pixel(intrinsics(), kPincushion, ideal);
      image(v, u) = float(pattern(ideal));
    }
  return image;
}

const std::string kCamera =
    "width_px: 200\nheight_px: 160\nintrinsics: [[650, 0, 104], [0, 640, 77], [0, 0, 1]]\n"
    "radial_distortion: [3, 10, 0]\n";
const std::string kPlace =
    "camera_from_world:\n  target: camera\n  source: world\n  rotation: [[1, 0, 0], [0, 1, 0], [0, 0, 1]]\n"
    "  translation_mm: [1, 2, 900]\n";

class ReadCalibration : public InAFolder {
 protected:
  ReadCalibration() {
    const cv::Mat1f image = as_taken();
    ItkGrid<float> grid{.size = {kWidth, kHeight}};
    grid.samples.assign(image.begin(), image.end());
    write_itk(folder / "a.tif", grid);
    put(folder / "a.yaml", "marrow-camera: 1\n" + kCamera + kPlace);
    put(folder / "plain.yaml", "marrow-camera: 1\n" + with(kCamera, "radial_distortion: [3, 10, 0]\n", "") + kPlace);
    put(folder / "c.yaml", "marrow-calibration: 1\n" + kCamera);
  }
};

/// Whether a place of the straight image was seen.
bool is_inside(const Vector2d& seen) {
  return seen.x() >= 0 && seen.y() >= 0 && seen.x() <= kWidth - 1 && seen.y() <= kHeight - 1;
}

void expect_straight(const View& view) {
  ASSERT_EQ(view.mask.size(), cv::Size(kWidth, kHeight)) << "the corners of the image as taken lie inside";
  int used = 0;
  double worst = 0;
  for (int v = 0; v < kHeight; ++v)
    for (int u = 0; u < kWidth; ++u) {
      const Vector2d seen = distorted_pixel(intrinsics(), kPincushion, {u, v});
      const bool inside = is_inside(seen);
      ASSERT_EQ(view.mask.at<std::uint8_t>(v, u) != 0, inside) << u << " " << v;
      if (!inside || seen.x() < 2 || seen.y() < 2 || seen.x() > kWidth - 3 || seen.y() > kHeight - 3) continue;
      worst = std::max(worst, std::abs(view.image.pixels.at<float>(v, u) - pattern({u, v})));
      ++used;
    }
  EXPECT_GT(used, kWidth * kHeight * 3 / 4);
  EXPECT_LT(worst, 0.05) << "of an amplitude of 100";
  EXPECT_EQ(view.camera.intrinsics, intrinsics()) << "the pinhole keeps its camera matrix";
}

TEST(Calibration, ForwardModelByHand) {
  const Vector2d seen = distorted_pixel(intrinsics(), kPincushion, {104 + 65, 77});
  const double r2 = 0.01, factor = 1 + 3 * r2 + 10 * r2 * r2;
  EXPECT_NEAR(seen.x(), 104 + 65 * factor, 1e-9);
  EXPECT_NEAR(seen.y(), 77, 1e-9);
}

TEST_F(ReadCalibration, CameraFileWithDistortion) {
  const View read = view_from(nullptr, {"a", folder / "a.tif", folder / "a.yaml"});
  expect_straight(read);
  EXPECT_EQ(read.camera.camera_from_world.translation_mm.z(), 900);
}

TEST_F(ReadCalibration, CalibrationOfTheDeviceReplacesTheCameraMatrix) {
  Camera nominal{kWidth, kHeight, Matrix3d::Identity(), {}};
  nominal.intrinsics << 600, 0, 99.5, 0, 600, 79.5, 0, 0, 1;
  nominal.camera_from_world = {"camera", "world", Matrix3d::Identity(), {0, 0, 600}};
  const View read = view_from(&nominal, {"a", folder / "a.tif", {}, folder / "c.yaml"});
  expect_straight(read);
  EXPECT_EQ(read.camera.camera_from_world.translation_mm.z(), 600);
}

TEST_F(ReadCalibration, Refusals) {
  const auto read = [&](const std::string& camera, const std::string& calibration) {
    put(folder / "c.yaml", "marrow-calibration: 1\n" + calibration);
    return view_from(nullptr, {"a", folder / "a.tif", folder / camera, folder / "c.yaml"});
  };
  EXPECT_SAYS(read("a.yaml", kCamera), "which can be removed only once");
  EXPECT_SAYS(read("plain.yaml", with(kCamera, "width_px: 200", "width_px: 300")),
              "the image has 200 x 160 pixels, but the calibration is of images of 300 x 160");
  EXPECT_SAYS(read("plain.yaml", with(kCamera, "[3, 10, 0]", "[-30, 0, 0]")), "the radial distortion folds the image");
  EXPECT_SAYS(read("plain.yaml", with(kCamera, "[3, 10, 0]", "[3, 10]")),
              "c.yaml:5:20: calibration: radial_distortion: expected 3 numbers");
}

TEST(Calibration, OwnMaskIsMovedAlong) {
  View read;
  read.name = "a";
  read.image.pixels = as_taken();
  read.camera = {kWidth, kHeight, intrinsics(), {"camera", "world", Matrix3d::Identity(), {0, 0, 600}}};
  read.mask = cv::Mat1b(kHeight, kWidth, std::uint8_t(255));
  const Vector2d hidden = distorted_pixel(intrinsics(), kPincushion, {150, 40});
  read.mask(cv::Rect(int(hidden.x()) - 2, int(hidden.y()) - 2, 6, 6)) = 0;
  remove_distortion(read, kPincushion);
  EXPECT_EQ(read.mask.at<std::uint8_t>(40, 150), 0);
  EXPECT_EQ(read.mask.at<std::uint8_t>(77, 104), 255);
}

/// Boxes, a line one pixel wide and single pixels, zero on 255.
cv::Mat1b drawn() {
  cv::Mat1b mask(kHeight, kWidth, std::uint8_t(255));
  mask(cv::Rect(20, 30, 50, 40)) = 0;
  mask(cv::Rect(120, 90, 70, 60)) = 0;
  mask(cv::Rect(100, 5, 1, 150)) = 0;
  for (int i = 0; i < 40; ++i) mask((i * 37) % kHeight, (i * 53) % kWidth) = 0;
  return mask;
}

TEST(Calibration, MaskDrawnOnTheStraightImageComesBack) {
  for (const RadialDistortion& distortion : {kPincushion, RadialDistortion{{-3.5, 2, 0}}}) {
    const cv::Mat1b mask = drawn();
    const cv::Mat1b original = original_mask(mask, intrinsics(), distortion);
    const cv::Mat1b again = straightened_mask(original, intrinsics(), distortion);
    int moved = 0;
    for (int v = 0; v < kHeight; ++v)
      for (int u = 0; u < kWidth; ++u) {
        const Vector2d seen = distorted_pixel(intrinsics(), distortion, {u, v});
        const bool inside = is_inside(seen);
        if (!inside || mask(v, u) == 0) {
          EXPECT_EQ(again(v, u), 0) << "what was drawn is zero: " << u << " " << v;
        } else if (again(v, u) == 0) {
          const cv::Rect around = cv::Rect(u - 2, v - 2, 5, 5) & cv::Rect(0, 0, kWidth, kHeight);
          EXPECT_LT(cv::countNonZero(mask(around)), around.area()) << "far from what was drawn: " << u << " " << v;
        }
        moved += seen.x() > 0 && (seen - Vector2d(u, v)).norm() > 3;
      }
    EXPECT_GT(moved, kWidth * kHeight / 10) << "the distortion is strong";
    EXPECT_EQ(cv::norm(original_mask(again, intrinsics(), distortion), original, cv::NORM_INF), 0)
        << "reading and writing it again changes nothing";
  }
}

TEST(Calibration, MaskOfTheOriginalImageHasNoHoles) {
  const cv::Mat1b box = [] {
    cv::Mat1b mask(kHeight, kWidth, std::uint8_t(255));
    mask(cv::Rect(110, 20, 70, 100)) = 0;
    return mask;
  }();
  const cv::Mat1b original = original_mask(box, intrinsics(), kPincushion);
  for (int v = 0; v < kHeight; ++v) {  // a row crosses the box once
    int changes = 0;
    for (int u = 1; u < kWidth; ++u) changes += original(v, u) != original(v, u - 1);
    EXPECT_LE(changes, 2) << v;
  }
  EXPECT_SAYS(original_mask(box, intrinsics(), RadialDistortion{{-60, 0, 0}}),
              "the mask: the radial distortion folds the image");
}

TEST(Calibration, WithoutDistortionNothingChanges) {
  View read;
  read.name = "a";
  const cv::Mat1f image = as_taken();
  read.image.pixels = image;
  read.camera = {kWidth, kHeight, intrinsics(), {"camera", "world", Matrix3d::Identity(), {0, 0, 600}}};
  remove_distortion(read, {});
  EXPECT_LT(cv::norm(read.image.pixels, image, cv::NORM_INF), 1e-3);
  EXPECT_TRUE(read.mask.empty());
}

}  // namespace calibration_test
