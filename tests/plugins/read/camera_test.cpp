// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>
#include <yaml-cpp/yaml.h>

#include "tests/plugins/read/files.hpp"
#include "tests/plugins/read/reading.hpp"

namespace camera_test {

using marrow::test::put;
using marrow::test::TemporaryFolder;
using marrow::test::with;

marrow::Camera read(const std::filesystem::path& path, const marrow::Context& context = marrow::Context()) {
  return marrow::test::read_by<marrow::Camera>("read.camera", path, {}, context);
}

const std::string kXmalab =
    "image size\n640,480\n\ncamera matrix\n1000,0,320\n0,1001,240\n0,0,1\n\nrotation\n0,-1,0\n1,0,0\n0,0,1\n\n"
    "translation\n1\n-2.5\n900\n\n";

TEST(ReadCamera, XmalabText) {
  const TemporaryFolder folder;
  for (const std::string& text : {kXmalab, [] {
                                    std::string windows;
                                    for (char c : kXmalab)
                                      windows += c == '\n' ? std::string("\r\n") : std::string(1, c);
                                    return windows;
                                  }()}) {
    put(folder / "cam.txt", text);
    const marrow::Camera camera = read(folder / "cam.txt");
    EXPECT_EQ(camera.height_px, 480);
    EXPECT_EQ(camera.width_px, 640);
    EXPECT_EQ(camera.intrinsics(1, 1), 1001);
    EXPECT_EQ(camera.camera_from_world.rotation(0, 1), -1);
    EXPECT_EQ(camera.camera_from_world.translation_mm, Eigen::Vector3d(1, -2.5, 900));
    // The camera sees the point at (-20 + 1, 10 - 2.5, 100 + 900).
    EXPECT_LT((project(camera, {10, 20, 100}) - Eigen::Vector2d(320 - 19, 240 + 7.5 * 1.001)).norm(), 1e-9);
  }
}

// Metal beads whose positions in both images and in space are known. Their reprojection error is 0.02 to 0.36 px.
TEST(ReadCamera, RealBeadsReprojectWithinTheirMeasuredError) {
  MARROW_NEED_DATA(folder, "wrist");
  const marrow::Camera cameras[] = {read(folder / "cameras/xr_calib_wrist_cam01.txt"),
                                    read(folder / "cameras/xr_calib_wrist_cam02.txt")};
  const YAML::Node frames = YAML::LoadFile(folder / "beads.json")["beads"];
  int count = 0;
  double worst = 0;
  for (const auto& frame : frames)
    for (const auto& cluster : frame.second)
      for (const auto& bead : cluster.second) {
        if (!bead.IsMap() || !bead["xyz_mm"].IsSequence()) continue;
        const auto xyz = bead["xyz_mm"].as<std::vector<double>>();
        const char* keys[] = {"uv_cam01", "uv_cam02"};
        for (int k = 0; k < 2; ++k) {
          if (!bead[keys[k]].IsSequence()) continue;
          const auto uv = bead[keys[k]].as<std::vector<double>>();
          worst =
              std::max(worst, (project(cameras[k], {xyz[0], xyz[1], xyz[2]}) - Eigen::Vector2d(uv[0], uv[1])).norm());
          ++count;
        }
      }
  EXPECT_GE(count, 20);
  EXPECT_LT(worst, 0.6);
  RecordProperty("worst_px", std::to_string(worst));
}

const std::string kByAngles =
    "marrow-camera: 1\nwidth_px: 512\nheight_px: 256\nc_arm:\n  alpha_deg: 0\n  beta_deg: 90\n"
    "  source_to_detector_mm: 1000\n  source_to_isocentre_mm: 600\n  pixel_mm: 0.5\n";

// From the patient's right to the left: u points to the front (-y), v to the feet, the detector lies at x > 0.
TEST(ReadCamera, ByTheAnglesOfACArm) {
  const TemporaryFolder folder;
  put(folder / "cam.yaml", kByAngles);
  const marrow::Camera camera = read(folder / "cam.yaml");
  EXPECT_EQ(camera.intrinsics, (Eigen::Matrix3d() << 2000, 0, 255.5, 0, 2000, 127.5, 0, 0, 1).finished());
  const Eigen::Matrix3d axes = (Eigen::Matrix3d() << 0, -1, 0, 0, 0, -1, 1, 0, 0).finished();
  EXPECT_TRUE(camera.camera_from_world.rotation.isApprox(axes, 1e-12)) << camera.camera_from_world.rotation;
  EXPECT_TRUE(camera.camera_from_world.translation_mm.isApprox(Eigen::Vector3d(0, 0, 600), 1e-12));
}

TEST(ReadCamera, AnglesAndDistancesThatCannotBe) {
  const TemporaryFolder folder;
  const auto expect = [&](const std::string& text, const std::string& said) {
    put(folder / "cam.yaml", text);
    EXPECT_SAYS(read(folder / "cam.yaml"), said);
  };
  expect(with(kByAngles, "beta_deg: 90", "beta_deg: 190"),
         "cam.yaml:6:13: c_arm: beta_deg: expected -180 to 180, got 190");
  expect(with(kByAngles, "pixel_mm: 0.5", "pixel_mm: 0"), "pixel_mm: expected 0.001 to 100, got 0");
  expect(with(kByAngles, "isocentre_mm: 600", "isocentre_mm: 1000"),
         "cam.yaml:8:27: c_arm: source_to_isocentre_mm: the isocentre lies between source and detector; expected less "
         "than source_to_detector_mm");
  expect(with(kByAngles, "alpha_deg: 0", "alhpa_deg: 0"), "did you mean 'alpha_deg'?");
  expect(with(kByAngles, "  alpha_deg: 0\n", ""), "alpha_deg");
  expect(kByAngles + "intrinsics: [[1, 0, 0], [0, 1, 0], [0, 0, 1]]\n",
         "cam.yaml:10:13: camera: intrinsics: 'c_arm' already gives it; keep one of the two");
}

const std::string kMaya = "0,0,600\n0,0,0\n3.9,4.1,-632.5\n321,201,-1000\n0.1,640,480\n";

// Version 1 of MayaCam looks along its -z, has y up, and counts pixels from 1 at the lower left. Its principal point
// (321, 201) is (320, 279) here: 480 - 201.
TEST(ReadCamera, AMayaCam) {
  const TemporaryFolder folder;
  put(folder / "cam.csv", kMaya);
  const marrow::Camera camera = read(folder / "cam.csv");
  EXPECT_EQ(camera.width_px, 640);
  EXPECT_EQ(camera.height_px, 480);
  EXPECT_LT((project(camera, {0, 0, 0}) - Eigen::Vector2d(320, 279)).norm(), 1e-9);
  EXPECT_LT((project(camera, {6, 12, 0}) - Eigen::Vector2d(330, 259)).norm(), 1e-9);
  // Turned about x by 90 degrees it looks along y, and z is up in the image.
  put(folder / "cam.csv", with(with(kMaya, "0,0,600\n0,0,0", "0,-600,0\n90,0,0"), "640,480", "0,0"));
  const marrow::Camera turned = read(folder / "cam.csv");
  EXPECT_EQ(turned.height_px, 1024);
  EXPECT_LT((project(turned, {6, 0, 12}) - Eigen::Vector2d(330, 1024 - 201 - 20)).norm(), 1e-9);
  // First about z, then about the axes that were turned: x right is the world's y, and up is z.
  put(folder / "cam.csv", with(kMaya, "0,0,600\n0,0,0", "600,0,0\n90,0,90"));
  EXPECT_LT((project(read(folder / "cam.csv"), {0, 6, 12}) - Eigen::Vector2d(330, 259)).norm(), 1e-9);
}

TEST(ReadCamera, DiagnosesFaultsOfAMayaCamAtTheirLine) {
  const TemporaryFolder folder;
  const auto expect = [&](const std::string& text, const std::string& said) {
    put(folder / "cam.csv", text);
    EXPECT_SAYS(read(folder / "cam.csv"), said);
  };
  expect(with(kMaya, "321,201,-1000", "321,201"),
         "cam.csv:4: expected the principal point and minus the focal length, 3 numbers with commas between them, got "
         "'321,201'; a MayaCam has 5 such lines");
  expect(with(kMaya, "-1000", "1000"),
         "cam.csv:4: expected minus the focal length in pixels as its third number, got 1000");
  expect(with(kMaya, "640,480", "640,-480"), "cam.csv:5: expected the image's width and height in pixels, got -480");
  expect(kMaya + "1,2,3\n", "cam.csv:6: expected the end of the file after its 5 lines, got '1,2,3'");
}

TEST(ReadCamera, DiagnosesXmalabFaultsAtTheirLine) {
  const TemporaryFolder folder;
  const auto expect = [&](const std::string& text, const std::string& said) {
    put(folder / "cam.txt", text);
    EXPECT_SAYS(read(folder / "cam.txt"), said);
  };
  expect(with(kXmalab, "camera matrix", "camera"), "cam.txt:4: expected 'camera matrix', got 'camera'");
  expect(with(kXmalab, "1000,0,320", "1000,0"), "cam.txt:5: expected 3 numbers, got '1000,0'");
  expect(with(kXmalab, "-2.5", "nan"), "cam.txt:16: expected 1 numbers, got 'nan'");
  expect(with(kXmalab, "640,480", "-640,480"), "cam.txt:2: the image size is out of range");
  expect(with(kXmalab, "0,-1,0", "0,-2,0"), "the matrix under 'rotation' is not a rotation");
  expect(with(kXmalab, "1000,0,320", "-1000,0,320"), "positive focal lengths");
  expect(kXmalab.substr(0, 100), "cam.txt:");
  expect(kXmalab + kXmalab,
         "cam.txt:19: expected the end of the file after the translation, got 'image size', which is not read");
  expect(kXmalab + "undistortion\n0\n0\n",
         "got 'undistortion', which is not read: give images that are already undistorted");
  expect(with(with(kXmalab, "1000,0,320", "1000,0,0"), "0,0,1", "320,240,1"),
         "is not [f_u s u_0; 0 f_v v_0; 0 0 1], row by row; it looks transposed");
  expect("", "expected 'image size', got ''");
  expect(std::string(100000, 'x'), "expected a camera file");
  EXPECT_SAYS(read(folder / "absent.txt"), "there is no such file");
}

const std::string kYaml = R"(marrow-camera: 1
width_px: 640
height_px: 480
intrinsics: [[1000, 0, 320], [0, 1001, 240], [0, 0, 1]]
camera_from_world:
  target: camera
  source: world
  rotation: [[1, 0, 0], [0, 1, 0], [0, 0, 1]]
  translation_mm: [1, 2, 900]
)";

TEST(ReadCamera, OwnYaml) {
  const TemporaryFolder folder;
  put(folder / "cam.yaml", kYaml);
  const marrow::Camera camera = read(folder / "cam.yaml");
  EXPECT_EQ(camera.width_px, 640);
  EXPECT_EQ(camera.camera_from_world.translation_mm.z(), 900);
  put(folder / "cam.yaml", kYaml + "radial_distortion: [0.5, 0, 0]\n");
  std::string warning;
  marrow::Context::Hooks hooks;
  hooks.log = [&](std::string_view text, marrow::LogLevel) { warning = text; };
  EXPECT_EQ(read(folder / "cam.yaml", marrow::Context(hooks)).width_px, 640);
  EXPECT_NE(warning.find("cam.yaml: the images of this camera are distorted"), std::string::npos);
  put(folder / "cam.yaml", with(kYaml, "target: camera", "target: detector"));
  EXPECT_SAYS(read(folder / "cam.yaml"),
              "cam.yaml:6:11: camera_from_world: target: expected the frame 'camera', got 'detector'");
  put(folder / "cam.yaml", with(kYaml, "marrow-camera: 1\n", ""));
  EXPECT_SAYS(read(folder / "cam.yaml"), "key 'marrow-camera' is missing");
  put(folder / "cam.yaml", with(kYaml, "640", "640.5"));
  EXPECT_SAYS(read(folder / "cam.yaml"), "cam.yaml:2:11: camera: width_px: expected a whole number, got '640.5'");
}

}  // namespace camera_test
