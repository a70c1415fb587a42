// SPDX-License-Identifier: Apache-2.0
// Cameras as other systems give them: a projection matrix of any scale and sign, or a source and a detector.
#include <gtest/gtest.h>

#include <Eigen/Geometry>

#include "tests/plugins/read/files.hpp"
#include "tests/plugins/read/reading.hpp"

namespace camera_forms_test {

using marrow::test::put;
using marrow::test::TemporaryFolder;

std::string row(const Eigen::RowVectorXd& values) {
  std::ostringstream text;
  text.precision(17);
  for (Eigen::Index i = 0; i < values.size(); ++i) text << (i ? ", " : "[") << values[i];
  return text.str() + "]";
}

marrow::Camera camera_of(const std::string& keys) {
  const TemporaryFolder folder;
  put(folder / "cam.yaml", "marrow-camera: 1\nwidth_px: 640\nheight_px: 480\n" + keys);
  return marrow::test::read_by<marrow::Camera>("read.camera", folder / "cam.yaml", {}, {});
}

std::string refusal(const std::string& keys) {
  const TemporaryFolder folder;
  put(folder / "cam.yaml", "marrow-camera: 1\nwidth_px: 640\nheight_px: 480\n" + keys);
  return shipped::refusal("read.camera", {}, {{"path", (folder / "cam.yaml").string()}});
}

const Eigen::Matrix3d kIntrinsics = (Eigen::Matrix3d() << 1500, 2, 300, 0, 1450, 250, 0, 0, 1).finished();
const Eigen::Matrix3d kRotation =
    (Eigen::AngleAxisd(0.4, Eigen::Vector3d(1, 2, 3).normalized()) * Eigen::AngleAxisd(1.2, Eigen::Vector3d::UnitX()))
        .toRotationMatrix();
const Eigen::Vector3d kTranslation(12, -34, 700);

TEST(CameraForms, AMatrixOfAnyScaleAndSign) {
  Eigen::Matrix<double, 3, 4> p;
  p << kIntrinsics * kRotation, kIntrinsics * kTranslation;
  for (const double scale : {1.0, -1.0, 2e-3, -70.0}) {
    std::string text = "projection_matrix:\n";
    for (int r = 0; r < 3; ++r) text += "  - " + row(scale * p.row(r)) + "\n";
    const marrow::Camera camera = camera_of(text);
    EXPECT_TRUE(camera.intrinsics.isApprox(kIntrinsics, 1e-9)) << camera.intrinsics;
    EXPECT_TRUE(camera.camera_from_world.rotation.isApprox(kRotation, 1e-9));
    EXPECT_TRUE(camera.camera_from_world.translation_mm.isApprox(kTranslation, 1e-9));
  }
}

// A detector of 0.5 x 0.25 mm pixels, 1000 mm above the source. Its first pixel's centre is at (-30, 20, 900): a crop
// that is not centred on the foot of the source, which is at column 80 and row 200.
const std::string kDetector =
    "detector: {source_mm: [10, -30, -100], corner_mm: [-30, 20, 900], columns: [2, 0, 0], rows: [0, -1, 0], "
    "pixel_mm: [0.5, 0.25]}\n";

TEST(CameraForms, ASourceAndADetector) {
  std::string seen_from_source = kDetector;
  seen_from_source.replace(seen_from_source.find("rows: [0, -1, 0]"), 16, "rows: [0, 1, 0] ");
  seen_from_source.replace(seen_from_source.find("-30, 20, 900"), 12, "-30,-80, 900");
  const marrow::Camera camera = camera_of(seen_from_source);
  EXPECT_TRUE(camera.intrinsics.isApprox((Eigen::Matrix3d() << 2000, 0, 80, 0, 4000, 200, 0, 0, 1).finished(), 1e-12))
      << camera.intrinsics;
  EXPECT_LT((source_position_mm(camera) - Eigen::Vector3d(10, -30, -100)).norm(), 1e-9);
  // Half way to the pixel (100, 40) of the detector, which lies at (-30 + 50, -80 + 10, 900).
  EXPECT_LT((project(camera, {15, -50, 400}) - Eigen::Vector2d(100, 40)).norm(), 1e-9);
}

TEST(CameraForms, TheCentreOfTheDetector) {
  // The centre lies 319.5 columns and 239.5 rows from the first pixel.
  const marrow::Camera camera = camera_of(
      "detector: {source_mm: [10, -30, -100], centre_mm: [129.75, -20.125, 900], columns: [1, 0, 0], rows: [0, 1, 0], "
      "pixel_mm: [0.5, 0.25]}\n");
  EXPECT_LT((project(camera, {15, -50, 400}) - Eigen::Vector2d(100, 40)).norm(), 1e-9);
}

TEST(CameraForms, WhatIsRefused) {
  const auto expect = [](const std::string& keys, const std::string& part) {
    const std::string said = refusal(keys);
    EXPECT_NE(said.find(part), std::string::npos) << part << "\nit said:\n" << said;
  };
  expect(kDetector,
         "detector: the image is seen from the detector, and marrow takes images that are seen from the source: mirror "
         "it left to right");
  expect("projection_matrix: [[1, 0, 0, 0], [0, 1, 0, 0], [0, 0, 0, 1]]\n",
         "projection_matrix: does not project along rays from a source");
  expect("projection_matrix: [[1, 0, 0], [0, 1, 0], [0, 0, 0]]\n",
         "projection_matrix: expected 3 rows of 4 numbers, got a list of 3");
  expect(
      "detector: {source_mm: [0, 0, 0], corner_mm: [0, 0, 0], columns: [1, 0, 0], rows: [0, 1, 0], pixel_mm: [1, 1]}\n",
      "source_mm: the source lies in the detector's plane");
  expect(
      "detector: {source_mm: [0, 0, 9], corner_mm: [0, 0, 0], columns: [1, 0, 0], rows: [1, 1, 0], pixel_mm: [1, 1]}\n",
      "rows: expected a direction at a right angle to 'columns'");
  expect(
      "detector: {source_mm: [0, 0, 9], corner_mm: [0, 0, 0], columns: [1, 0, 0], rows: [0, 1, 0], pixel_mm: [0, 1]}\n",
      "pixel_mm: expected the width and the height of a pixel, more than 0");
  expect("c_arm: {}\n" + kDetector, "detector: 'c_arm' already gives the camera; keep one of the two");
  expect("intrinsics: [[1, 0, 0], [0, 1, 0], [0, 0, 1]]\n" + kDetector,
         "intrinsics: 'detector' already gives it; keep one of the two");
}

}  // namespace camera_forms_test
