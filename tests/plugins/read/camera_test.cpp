// SPDX-License-Identifier: Apache-2.0
// Cameras in marrow's own files, in every form that other systems give them, and in those of XMALab and MayaCam.
#include <yaml-cpp/yaml.h>

#include "tests/plugins/read/damage.hpp"
#include "tests/plugins/read/reading.hpp"

namespace camera_test {

using namespace marrow;
using namespace marrow::test;
using Eigen::Matrix3d, Eigen::Vector2d, Eigen::Vector3d;

Camera read(const std::filesystem::path& path, const Context& context = Context()) {
  return read_by<Camera>("read.camera", path, {}, context);
}

Matrix3d matrix(double f_u, double skew, double u_0, double f_v, double v_0) {
  return (Matrix3d() << f_u, skew, u_0, 0, f_v, v_0, 0, 0, 1).finished();
}

class ReadCamera : public InAFolder {
 protected:
  Camera of(const std::string& name, const std::string& text) {
    put(folder / name, text);
    return read(folder / name);
  }
  void expect_faulty(const std::string& name, const std::string& good, const std::vector<Fault>& faults) {
    expect_faults(folder / name, good, faults, [](const auto& path) { read(path); });
  }
};

const std::string kXmalab =
    "image size\n640,480\n\ncamera matrix\n1000,0,320\n0,1001,240\n0,0,1\n\nrotation\n0,-1,0\n1,0,0\n0,0,1\n\n"
    "translation\n1\n-2.5\n900\n\n";

TEST_F(ReadCamera, XmalabText) {
  for (const std::string& text : {kXmalab, with_each(kXmalab, "\n", "\r\n")}) {
    const Camera camera = of("cam.txt", text);
    EXPECT_EQ(camera.height_px, 480);
    EXPECT_EQ(camera.width_px, 640);
    EXPECT_EQ(camera.intrinsics(1, 1), 1001);
    EXPECT_EQ(camera.camera_from_world.rotation(0, 1), -1);
    EXPECT_EQ(camera.camera_from_world.translation_mm, Vector3d(1, -2.5, 900));
    // The camera sees the point at (-20 + 1, 10 - 2.5, 100 + 900).
    EXPECT_LT((project(camera, {10, 20, 100}) - Vector2d(320 - 19, 240 + 7.5 * 1.001)).norm(), 1e-9);
  }
  EXPECT_SAYS(read(folder / "absent.txt"), "there is no such file");
  expect_faulty(
      "cam.txt", kXmalab,
      {{"camera matrix", "camera", "cam.txt:4: expected 'camera matrix', got 'camera'"},
       {"1000,0,320", "1000,0", "cam.txt:5: expected 3 numbers, got '1000,0'"},
       {"-2.5", "nan", "cam.txt:16: expected 1 numbers, got 'nan'"},
       {"640,480", "-640,480", "cam.txt:2: the image size is out of range"},
       {"0,-1,0", "0,-2,0", "the matrix under 'rotation' is not a rotation"},
       {"1000,0,320", "-1000,0,320", "positive focal lengths"},
       {"", kXmalab.substr(0, 100), "cam.txt:"},
       {"", kXmalab + kXmalab,
        "cam.txt:19: expected the end of the file after the translation, got 'image size', which is not read"},
       {"", kXmalab + "undistortion\n0\n0\n",
        "got 'undistortion', which is not read: give images that are already undistorted"},
       {"", with(with(kXmalab, "1000,0,320", "1000,0,0"), "0,0,1", "320,240,1"),
        "is not [f_u s u_0; 0 f_v v_0; 0 0 1], row by row; it looks transposed"},
       {"", "", "expected 'image size', got ''"},
       {"", std::string(100000, 'x'), "expected a camera file"}});
}

// Metal beads whose positions in both images and in space are known. Their reprojection error is 0.02 to 0.36 px.
TEST_F(ReadCamera, RealBeadsReprojectWithinTheirMeasuredError) {
  MARROW_NEED_DATA(folder, "wrist");
  const std::pair<const char*, Camera> cameras[] = {{"uv_cam01", read(folder / "cameras/xr_calib_wrist_cam01.txt")},
                                                    {"uv_cam02", read(folder / "cameras/xr_calib_wrist_cam02.txt")}};
  const YAML::Node frames = YAML::LoadFile(folder / "beads.json")["beads"];
  int count = 0;
  double worst = 0;
  for (const auto& frame : frames)
    for (const auto& cluster : frame.second)
      for (const auto& bead : cluster.second) {
        if (!bead.IsMap() || !bead["xyz_mm"].IsSequence()) continue;
        const auto xyz = bead["xyz_mm"].as<std::vector<double>>();
        for (const auto& [key, camera] : cameras) {
          if (!bead[key].IsSequence()) continue;
          const auto uv = bead[key].as<std::vector<double>>();
          worst = std::max(worst, (project(camera, {xyz[0], xyz[1], xyz[2]}) - Vector2d(uv[0], uv[1])).norm());
          ++count;
        }
      }
  EXPECT_GE(count, 20);
  EXPECT_LT(worst, 0.6);
  RecordProperty("worst_px", std::to_string(worst));
}

const std::string kMaya = "0,0,600\n0,0,0\n3.9,4.1,-632.5\n321,201,-1000\n0.1,640,480\n";

// Version 1 of MayaCam looks along its -z, has y up, and counts pixels from 1 at the lower left. Its principal point
// (321, 201) is (320, 279) here: 480 - 201.
TEST_F(ReadCamera, AMayaCam) {
  const Camera camera = of("cam.csv", kMaya);
  EXPECT_EQ(camera.width_px, 640);
  EXPECT_EQ(camera.height_px, 480);
  EXPECT_LT((project(camera, {0, 0, 0}) - Vector2d(320, 279)).norm(), 1e-9);
  EXPECT_LT((project(camera, {6, 12, 0}) - Vector2d(330, 259)).norm(), 1e-9);
  // Turned about x by 90 degrees it looks along y, and z is up in the image.
  const Camera turned = of("cam.csv", with(with(kMaya, "0,0,600\n0,0,0", "0,-600,0\n90,0,0"), "640,480", "0,0"));
  EXPECT_EQ(turned.height_px, 1024);
  EXPECT_LT((project(turned, {6, 0, 12}) - Vector2d(330, 1024 - 201 - 20)).norm(), 1e-9);
  // First about z, then about the axes that were turned: x right is the world's y, and up is z.
  const Camera twice = of("cam.csv", with(kMaya, "0,0,600\n0,0,0", "600,0,0\n90,0,90"));
  EXPECT_LT((project(twice, {0, 6, 12}) - Vector2d(330, 259)).norm(), 1e-9);
  expect_faulty(
      "cam.csv", kMaya,
      {{"321,201,-1000", "321,201",
        "cam.csv:4: expected the principal point and minus the focal length, 3 numbers with commas between them, got "
        "'321,201'; a MayaCam has 5 such lines"},
       {"-1000", "1000", "cam.csv:4: expected minus the focal length in pixels as its third number, got 1000"},
       {"640,480", "640,-480", "cam.csv:5: expected the image's width and height in pixels, got -480"},
       {"", kMaya + "1,2,3\n", "cam.csv:6: expected the end of the file after its 5 lines, got '1,2,3'"}});
}

const std::string kSize = "marrow-camera: 1\nwidth_px: 640\nheight_px: 480\n";
const std::string kYaml =
    kSize +
    "intrinsics: [[1000, 0, 320], [0, 1001, 240], [0, 0, 1]]\ncamera_from_world:\n  target: camera\n"
    "  source: world\n  rotation: [[1, 0, 0], [0, 1, 0], [0, 0, 1]]\n  translation_mm: [1, 2, 900]\n";

TEST_F(ReadCamera, OwnYaml) {
  const Camera camera = of("cam.yaml", kYaml);
  EXPECT_EQ(camera.width_px, 640);
  EXPECT_EQ(camera.camera_from_world.translation_mm.z(), 900);
  put(folder / "cam.yaml", kYaml + "radial_distortion: [0.5, 0, 0]\n");
  const auto said = said_by([&](const Context& context) { read(folder / "cam.yaml", context); });
  EXPECT_HAS(said.at(0), "cam.yaml: the images of this camera are distorted");
  expect_faulty("cam.yaml", kYaml,
                {{"target: camera", "target: detector",
                  "cam.yaml:6:11: camera_from_world: target: expected the frame 'camera', got 'detector'"},
                 {"marrow-camera: 1\n", "", "key 'marrow-camera' is missing"},
                 {"640", "640.5", "cam.yaml:2:11: camera: width_px: expected a whole number, got '640.5'"}});
}

// From the patient's right to the left: u points to the front (-y), v to the feet, the detector lies at x > 0.
TEST_F(ReadCamera, ByTheAnglesOfACArm) {
  const std::string by_angles =
      "marrow-camera: 1\nwidth_px: 512\nheight_px: 256\nc_arm:\n  alpha_deg: 0\n  beta_deg: 90\n"
      "  source_to_detector_mm: 1000\n  source_to_isocentre_mm: 600\n  pixel_mm: 0.5\n";
  const Camera camera = of("cam.yaml", by_angles);
  EXPECT_EQ(camera.intrinsics, matrix(2000, 0, 255.5, 2000, 127.5));
  const Matrix3d axes = (Matrix3d() << 0, -1, 0, 0, 0, -1, 1, 0, 0).finished();
  EXPECT_TRUE(camera.camera_from_world.rotation.isApprox(axes, 1e-12)) << camera.camera_from_world.rotation;
  EXPECT_TRUE(camera.camera_from_world.translation_mm.isApprox(Vector3d(0, 0, 600), 1e-12));
  expect_faulty("cam.yaml", by_angles,
                {{"beta_deg: 90", "beta_deg: 190", "cam.yaml:6:13: c_arm: beta_deg: expected -180 to 180, got 190"},
                 {"pixel_mm: 0.5", "pixel_mm: 0", "pixel_mm: expected 0.001 to 100, got 0"},
                 {"isocentre_mm: 600", "isocentre_mm: 1000",
                  "cam.yaml:8:27: c_arm: source_to_isocentre_mm: the isocentre lies between source and detector; "
                  "expected less than source_to_detector_mm"},
                 {"alpha_deg: 0", "alhpa_deg: 0", "did you mean 'alpha_deg'?"},
                 {"  alpha_deg: 0\n", "", "alpha_deg"},
                 {"", by_angles + "intrinsics: [[1, 0, 0], [0, 1, 0], [0, 0, 1]]\n",
                  "cam.yaml:10:13: camera: intrinsics: 'c_arm' already gives it; keep one of the two"}});
}

TEST_F(ReadCamera, AMatrixOfAnyScaleAndSign) {
  const Matrix3d intrinsics = matrix(1500, 2, 300, 1450, 250);
  const Matrix3d rotation =
      (Eigen::AngleAxisd(0.4, Vector3d(1, 2, 3).normalized()) * Eigen::AngleAxisd(1.2, Vector3d::UnitX()))
          .toRotationMatrix();
  const Vector3d translation(12, -34, 700);
  Eigen::Matrix<double, 3, 4> p;
  p << intrinsics * rotation, intrinsics * translation;
  const Eigen::IOFormat yaml(17, Eigen::DontAlignCols, ", ", ", ", "[", "]", "[", "]");
  for (const double scale : {1.0, -1.0, 2e-3, -70.0}) {
    std::ostringstream text;
    text << "projection_matrix: " << (scale * p).format(yaml) << "\n";
    const Camera camera = of("cam.yaml", kSize + text.str());
    EXPECT_TRUE(camera.intrinsics.isApprox(intrinsics, 1e-9)) << camera.intrinsics;
    EXPECT_TRUE(camera.camera_from_world.rotation.isApprox(rotation, 1e-9));
    EXPECT_TRUE(camera.camera_from_world.translation_mm.isApprox(translation, 1e-9));
  }
}

// A detector of 0.5 x 0.25 mm pixels, 1000 mm above the source. Its first pixel's centre is at (-30, -80, 900): a crop
// that is not centred on the foot of the source, which is at column 80 and row 200.
const std::string kDetector =
    "detector: {source_mm: [10, -30, -100], corner_mm: [-30, -80, 900], columns: [2, 0, 0], rows: [0, 1, 0], "
    "pixel_mm: [0.5, 0.25]}\n";

TEST_F(ReadCamera, ASourceAndADetector) {
  const Camera camera = of("cam.yaml", kSize + kDetector);
  EXPECT_TRUE(camera.intrinsics.isApprox(matrix(2000, 0, 80, 4000, 200), 1e-12)) << camera.intrinsics;
  EXPECT_LT((source_position_mm(camera) - Vector3d(10, -30, -100)).norm(), 1e-9);
  // Half way to the pixel (100, 40) of the detector, which lies at (-30 + 50, -80 + 10, 900).
  EXPECT_LT((project(camera, {15, -50, 400}) - Vector2d(100, 40)).norm(), 1e-9);
  // The centre lies 319.5 columns and 239.5 rows from the first pixel.
  const Camera centred =
      of("cam.yaml", kSize + with(kDetector, "corner_mm: [-30, -80, 900]", "centre_mm: [129.75, -20.125, 900]"));
  EXPECT_LT((project(centred, {15, -50, 400}) - Vector2d(100, 40)).norm(), 1e-9);
}

TEST_F(ReadCamera, MatricesAndDetectorsThatAreRefused) {
  const auto simple = [](const std::string& from, const std::string& to) {
    return kSize + with(
                       "detector: {source_mm: [0, 0, 9], corner_mm: [0, 0, 0], columns: [1, 0, 0], rows: [0, 1, 0], "
                       "pixel_mm: [1, 1]}\n",
                       from, to);
  };
  expect_faulty(
      "cam.yaml", kSize + kDetector,
      {{"[-30, -80, 900], columns: [2, 0, 0], rows: [0, 1, 0]", "[-30, 20, 900], columns: [2, 0, 0], rows: [0, -1, 0]",
        "detector: the image is seen from the detector, and marrow takes images that are seen from the source: mirror "
        "it left to right"},
       {"", kSize + "projection_matrix: [[1, 0, 0, 0], [0, 1, 0, 0], [0, 0, 0, 1]]\n",
        "projection_matrix: does not project along rays from a source"},
       {"", kSize + "projection_matrix: [[1, 0, 0], [0, 1, 0], [0, 0, 0]]\n",
        "projection_matrix: expected 3 rows of 4 numbers, got a list of 3"},
       {"", simple("[0, 0, 9]", "[0, 0, 0]"), "source_mm: the source lies in the detector's plane"},
       {"", simple("rows: [0, 1, 0]", "rows: [1, 1, 0]"), "rows: expected a direction at a right angle to 'columns'"},
       {"", simple("[1, 1]", "[0, 1]"), "pixel_mm: expected the width and the height of a pixel, more than 0"},
       {"detector:", "c_arm: {}\ndetector:", "detector: 'c_arm' already gives the camera; keep one of the two"},
       {"detector:", "intrinsics: [[1, 0, 0], [0, 1, 0], [0, 0, 1]]\ndetector:",
        "intrinsics: 'detector' already gives it; keep one of the two"}});
}

}  // namespace camera_test
