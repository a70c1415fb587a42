// SPDX-License-Identifier: Apache-2.0
// How exactly a camera is known, as a camera file or a case says it.
#include <gtest/gtest.h>

#include "marrow/toolbox/geometry/camera_deviations.hpp"
#include "tests/plugins/read/files.hpp"
#include "tests/plugins/read/itk_files.hpp"
#include "tests/plugins/read/reading.hpp"

namespace stated_deviations_test {

using marrow::geometry::CameraDeviations;
using marrow::test::put;

const std::string kArm =
    "c_arm: {alpha_deg: 0, beta_deg: 0, source_to_detector_mm: {value: 1000, deviation: 40}, "
    "source_to_isocentre_mm: {value: 600, deviation: 25}, pixel_mm: {value: 0.5, deviation: 0.015}}\n";
const std::string kSize = "marrow-camera: 1\nwidth_px: 6\nheight_px: 4\n";

/// A folder with an image of 6 x 4 pixels and a camera file.
class StatedDeviations : public testing::Test {
 protected:
  StatedDeviations() {
    const marrow::test::ItkGrid<std::uint8_t> pixels{.size = {6, 4}, .samples = std::vector<std::uint8_t>(24, 9)};
    write_itk(folder / "a.png", pixels);
  }
  shipped::Options options(const std::string& camera) {
    put(folder / "a.yaml", kSize + camera);
    return {{"image", (folder / "a.png").string()}, {"camera", (folder / "a.yaml").string()}};
  }
  CameraDeviations of_view(const std::string& camera) {
    return shipped::call("read.view", {}, options(camera)).at("camera_deviations").as<CameraDeviations>();
  }
  void expect_refused(const std::string& camera, const std::string& part) {
    const std::string said = shipped::refusal("read.view", {}, options(camera));
    EXPECT_NE(said.find(part), std::string::npos) << said;
  }
  marrow::test::TemporaryFolder folder;
};

TEST_F(StatedDeviations, OfDistancesAndPixels) {
  const CameraDeviations stated = of_view(kArm);
  EXPECT_NEAR(stated.focal_percent.value(), 5, 1e-12) << "4 % of the distance and 3 % of the pixel";
  EXPECT_EQ(stated.source_mm, 25);
  EXPECT_FALSE(stated.centre_px || stated.turn_deg || stated.shift_mm);
  const auto outputs = shipped::call("read.view", {}, options(kArm));
  const marrow::Camera camera = outputs.at("view").as<marrow::View>().camera;
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
  expect_refused(kArm + "deviations: {focal_percent: 3}\n",
                 "focal_percent: the deviations of the distances already give it; keep one of the two");
  expect_refused(kArm + "deviations: {centre: 3}\n", "unknown key 'centre'");
  expect_refused(kArm + "deviations: {turn_deg: -1}\n", "turn_deg: expected 0 to 45, got -1");
  std::string arm = kArm;
  arm.replace(arm.find("deviation: 40"), 13, "deviation: -4");
  expect_refused(arm, "source_to_detector_mm: deviation: expected 0 to 10000, got -4");
  arm = kArm;
  arm.replace(arm.find("value: 1000, "), 13, "");
  expect_refused(arm, "value");
}

TEST_F(StatedDeviations, OfACaseAndItsCameraFiles) {
  options(kArm);
  put(folder / "case.yaml",
      "marrow-case: 1\nct: ct.mha\nviews:\n"
      "  - {name: frontal, image: a.png, camera: a.yaml}\n"
      "  - {name: lateral, image: a.png, camera: {file: a.yaml, deviations: {centre_px: 30}}}\n"
      "fragments: {distal: {seeds: [[0, 0, 1]]}}\n");
  write_itk(folder / "ct.mha",
            marrow::test::ItkGrid<std::int16_t>{.size = {3, 3, 3}, .samples = std::vector<std::int16_t>(27, 40)});
  const auto stated = shipped::call("read.case", {}, {{"path", folder.path().string()}})
                          .at("camera_deviations")
                          .as_list<CameraDeviations>();
  ASSERT_EQ(stated.names(), (std::vector<std::string>{"frontal", "lateral"}));
  EXPECT_NEAR(stated[0].focal_percent.value(), 5, 1e-12);
  EXPECT_EQ(stated[1].centre_px, 30);
  EXPECT_FALSE(stated[1].focal_percent) << "what the case says takes the place of the file's";
}

TEST_F(StatedDeviations, ACameraAloneDoesNotPassThemOn) {
  put(folder / "a.yaml", kSize + kArm);
  std::vector<std::string> warnings;
  marrow::Context::Hooks hooks;
  hooks.log = [&](std::string_view text, marrow::LogLevel level) {
    if (level == marrow::LogLevel::warning) warnings.emplace_back(text);
  };
  marrow::test::read_by<marrow::Camera>("read.camera", folder / "a.yaml", {}, marrow::Context(hooks));
  EXPECT_EQ(warnings, std::vector<std::string>{(folder / "a.yaml").string() +
                                               ": states how exactly the camera is known; only read.view, read.views "
                                               "and read.case pass that on, if they read the camera file themselves"});
}

}  // namespace stated_deviations_test
