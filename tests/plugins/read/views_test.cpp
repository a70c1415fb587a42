// SPDX-License-Identifier: Apache-2.0
// Views: images with their cameras, and how exactly these are known.
// The distortion of an image is removed once, when its view is read.

#include "marrow/read/camera_file.hpp"
#include "tests/plugins/read/itk_files.hpp"
#include "tests/plugins/read/reading.hpp"

namespace views_test {

using namespace marrow;
using namespace marrow::test;
using Eigen::Vector2d, Eigen::Matrix3d;
using geometry::CameraDeviations;

std::vector<std::string> texts(const std::vector<std::filesystem::path>& paths) { return {paths.begin(), paths.end()}; }

/// Two images of 6 x 4 pixels, whose values rise, with cameras.
class ReadViews : public InAFolder {
 protected:
  ReadViews() {
    for (const char* name : {"a", "b"}) {
      write_itk(folder / (name + std::string(".png")), ramp<std::uint8_t>({6, 4}, 1));
      put(folder / (name + std::string(".txt")), xmalab_camera(6, 4));
    }
    options["names"] = std::vector<std::string>{"one", "two"};
    options["images"] = texts({folder / "a.png", folder / "b.png"});
    options["cameras"] = texts({folder / "a.txt", folder / "b.txt"});
  }
  List<View> views(const shipped::Inputs& inputs = {}) {
    return shipped::call("read.views", inputs, options).at("views").as_list<View>();
  }
  shipped::Options options;
};

TEST_F(ReadViews, OneTakesItsCameraFromAFileOrAValue) {
  const View from_file = view_from(nullptr, {"frontal", folder / "a.png", folder / "a.txt"});
  EXPECT_EQ(from_file.name, "frontal");
  EXPECT_EQ(from_file.camera.width_px, 6);
  Camera camera = from_file.camera;
  camera.camera_from_world.translation_mm.z() = 700;
  EXPECT_EQ(view_from(&camera, {"frontal", folder / "a.png"}).camera.camera_from_world.translation_mm.z(), 700);
  EXPECT_TRUE(shipped::declares("read.view", exactly_one({"in.camera", "camera"})));
  // The camera is that of the image that was turned over, so it stays as it is.
  const View view = shipped::call("read.view", {{"camera", shipped::item(camera)}},
                                  {{"image", (folder / "a.png").string()}, {"mirror", "upside_down"}})
                        .at("view")
                        .as<View>();
  EXPECT_EQ(view.image.pixels.at<std::uint8_t>(0, 2), 3 * 6 + 2);
  EXPECT_EQ(hash_of(view.camera), hash_of(camera));
  camera.width_px = 7;
  EXPECT_SAYS(view_from(&camera, {"frontal", folder / "a.png"}),
              "view 'frontal': the image has 6 x 4 pixels, but its camera is for 7 x 4");
}

TEST_F(ReadViews, AllImagesAreTurnedOver) {
  options["mirror"] = "left_right";
  EXPECT_EQ(views()[1].image.pixels.at<std::uint8_t>(1, 6 - 1 - 2), 6 + 2);
}

TEST_F(ReadViews, AViewWithoutAnImageIsLeftOut) {
  options["images"] = texts({folder / "a.png", ""});
  options["cameras"] = texts({folder / "a.txt", ""});
  EXPECT_EQ(views().names(), std::vector<std::string>{"one"});
  options["images"] = texts({"", ""});
  EXPECT_EQ(shipped::refusal("read.views", {}, options),
            "all images are empty, so there is no view; give at least one image");
  options["images"] = texts({folder / "a.png", folder / "b.png"});
  EXPECT_EQ(shipped::refusal("read.views", {}, options), "view 'two': its camera is not given");
}

TEST_F(ReadViews, ImagesWithTheirCameras) {
  put(folder / "b.txt", xmalab_camera(6, 4, "700"));
  const auto value = views();
  EXPECT_EQ(value.names(), (std::vector<std::string>{"one", "two"}));
  EXPECT_EQ(value[1].name, "two");
  EXPECT_EQ(value[0].camera.camera_from_world.translation_mm.z(), 600);
  EXPECT_EQ(value[1].camera.camera_from_world.translation_mm.z(), 700);
  write_itk(folder / "b.png", filled<std::uint8_t>({6, 5}, 9));
  EXPECT_SAYS(views(), "view 'two': the image has 6 x 5 pixels, but its camera is for 6 x 4");
}

TEST_F(ReadViews, CamerasAsValuesAreFoundByName) {
  List<Camera> cameras;
  for (const auto& [name, z] : {std::pair{"two", 2}, {"one", 1}})
    cameras.add(name, {6,
                       4,
                       Eigen::Vector3d(10, 10, 1).asDiagonal(),
                       {"camera", "world", Eigen::Matrix3d::Identity(), Eigen::Vector3d(0, 0, z)}});
  options.erase("cameras");
  const shipped::Inputs wired{{"camera", shipped::list(cameras, "view")}};
  EXPECT_EQ(views(wired)[0].camera.camera_from_world.translation_mm.z(), 1);
  options["names"] = std::vector<std::string>{"one", "three"};
  EXPECT_SAYS(views(wired), "view 'three' has no camera of that name; there are 'two', 'one'");
}

TEST_F(ReadViews, DeclaresAnImageAndACameraForEachName) {
  EXPECT_TRUE(shipped::declares("read.views", at_least_one({"names"})));
  EXPECT_TRUE(shipped::declares("read.views", distinct("names")));
  EXPECT_TRUE(shipped::declares("read.views", same_length({"names", "images"})));
  EXPECT_TRUE(shipped::declares("read.views", exactly_one({"in.camera", "cameras"})));
  EXPECT_TRUE(shipped::declares("read.views", as_many_or_none("cameras", "names")));
  EXPECT_TRUE(shipped::declares("read.images", as_many_or_none("names", "paths")));
  options["cameras"] = texts({folder / "a.txt"});
  EXPECT_THROW(views(), std::out_of_range) << "nothing is read past the end of a list";
}

TEST_F(ReadViews, RealWristPairs) {
  MARROW_NEED_DATA(data, "wrist");
  options["images"] =
      texts({data / "images/xr_rad_uln_cam01_UND.0002.tif", data / "images/xr_rad_uln_cam02_UND.0002.tif"});
  options["cameras"] = texts({data / "cameras/xr_calib_wrist_cam01.txt", data / "cameras/xr_calib_wrist_cam02.txt"});
  const auto value = views();
  EXPECT_EQ(value[0].image.width(), 1760);
  const double angle = std::acos(
      value[0].camera.camera_from_world.rotation.row(2).dot(value[1].camera.camera_from_world.rotation.row(2)));
  EXPECT_NEAR(degrees(angle), 110, 3) << "the cameras stand 110 degrees apart";
}

// ---- how exactly a camera is known, as a camera file or a case says it

const std::string kArm =
    "c_arm: {alpha_deg: 0, beta_deg: 0, source_to_detector_mm: {value: 1000, deviation: 40}, "
    "source_to_isocentre_mm: {value: 600, deviation: 25}, pixel_mm: {value: 0.5, deviation: 0.015}}\n";

class StatedDeviations : public ReadViews {
 protected:
  shipped::Outputs view(const std::string& camera) {
    put(folder / "a.yaml", "marrow-camera: 1\nwidth_px: 6\nheight_px: 4\n" + camera);
    return shipped::call("read.view", {},
                         {{"image", (folder / "a.png").string()}, {"camera", (folder / "a.yaml").string()}});
  }
  CameraDeviations of_view(const std::string& camera) {
    return view(camera).at("camera_deviations").as<CameraDeviations>();
  }
};

TEST_F(StatedDeviations, OfDistancesAndPixels) {
  const CameraDeviations stated = of_view(kArm);
  EXPECT_NEAR(stated.focal_percent.value(), 5, 1e-12) << "4 % of the distance and 3 % of the pixel";
  EXPECT_EQ(stated.source_mm, 25);
  EXPECT_FALSE(stated.centre_px || stated.turn_deg || stated.shift_mm);
  const Camera camera = view(kArm).at("view").as<View>().camera;
  EXPECT_EQ(camera.intrinsics(0, 0), 2000) << "the values are as without a deviation";
  EXPECT_EQ(camera.camera_from_world.translation_mm.z(), 600);
}

TEST_F(StatedDeviations, OfAnyCamera) {
  const CameraDeviations stated = of_view(
      "intrinsics: [[10, 0, 2.5], [0, 10, 1.5], [0, 0, 1]]\n"
      "camera_from_world: {target: camera, source: world, rotation: [[1, 0, 0], [0, 1, 0], [0, 0, 1]], "
      "translation_mm: [0, 0, 600]}\n"
      "deviations: {turn_deg: 0.5, shift_mm: 2, focal_percent: 3, centre_px: 40, source_mm: 7}\n");
  EXPECT_EQ(stated.turn_deg, 0.5);
  EXPECT_EQ(stated.shift_mm, 2);
  EXPECT_EQ(stated.focal_percent, 3);
  EXPECT_EQ(stated.centre_px, 40);
  EXPECT_EQ(stated.source_mm, 7);
}

TEST_F(StatedDeviations, WhatIsRefused) {
  EXPECT_SAYS(view(kArm + "deviations: {focal_percent: 3}\n"),
              "focal_percent: the deviations of the distances already give it; keep one of the two");
  EXPECT_SAYS(view(kArm + "deviations: {centre: 3}\n"), "unknown key 'centre'");
  EXPECT_SAYS(view(kArm + "deviations: {turn_deg: -1}\n"), "turn_deg: expected 0 to 45, got -1");
  EXPECT_SAYS(view(with(kArm, "deviation: 40", "deviation: -4")),
              "source_to_detector_mm: deviation: expected 0 to 10000, got -4");
  EXPECT_SAYS(view(with(kArm, "value: 1000, ", "")), "value");
}

TEST_F(StatedDeviations, OfACaseAndItsCameraFiles) {
  view(kArm);
  put(folder / "case.yaml",
      "marrow-case: 1\nct: ct.mha\nviews:\n"
      "  - {name: frontal, image: a.png, camera: a.yaml}\n"
      "  - {name: lateral, image: a.png, camera: {file: a.yaml, deviations: {centre_px: 30}}}\n"
      "fragments: {distal: {seeds: [[0, 0, 1]]}}\n");
  write_itk(folder / "ct.mha", filled<std::int16_t>({3, 3, 3}, 40));
  const auto stated = shipped::call("read.case", {}, {{"path", folder.path().string()}})
                          .at("camera_deviations")
                          .as_list<CameraDeviations>();
  ASSERT_EQ(stated.names(), (std::vector<std::string>{"frontal", "lateral"}));
  EXPECT_NEAR(stated[0].focal_percent.value(), 5, 1e-12);
  EXPECT_EQ(stated[1].centre_px, 30);
  EXPECT_FALSE(stated[1].focal_percent) << "what the case says takes the place of the file's";
}

TEST_F(StatedDeviations, ACameraAloneDoesNotPassThemOn) {
  view(kArm);
  const auto warnings =
      said_by([&](const Context& context) { read_by<Camera>("read.camera", folder / "a.yaml", {}, context); },
              LogLevel::warning);
  EXPECT_EQ(warnings, std::vector<std::string>{(folder / "a.yaml").string() +
                                               ": states how exactly the camera is known; only read.view, read.views "
                                               "and read.case pass that on, if they read the camera file themselves"});
}

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

}  // namespace views_test
