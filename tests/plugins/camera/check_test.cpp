// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>
#include <yaml-cpp/yaml.h>

#include <cmath>
#include <cstdio>
#include <map>
#include <random>

#include "marrow/camera/points_file.hpp"
#include "marrow/domain/c_arm.hpp"
#include "marrow/toolbox/calibration/plausibility.hpp"
#include "marrow/toolbox/files/camera_file.hpp"
#include "marrow/toolbox/files/volume_file.hpp"
#include "shipped.hpp"
#include "tests/plugins/read/files.hpp"

namespace check_test {

using namespace marrow;
using calibration::SeenPoints;
using Eigen::Vector2d;
using Eigen::Vector3d;
using marrow::test::put;
using marrow::test::TemporaryFolder;
using marrow::test::with;

Camera camera_at(double alpha_deg, double beta_deg) {
  CArm arm{640, 512, {0.5, 0.5}, 1000, 600, Vector3d::Zero()};
  Camera camera = carm_camera(arm, world_from_camera_rotation(radians(alpha_deg), radians(beta_deg)));
  camera.intrinsics(0, 2) += 9;
  camera.intrinsics(1, 2) -= 6;
  return camera;
}

/// Points spread over the field, seen with a noise of 0.2 px.
SeenPoints points_of(const Camera& camera, int count = 20) {
  std::mt19937_64 random(3);
  std::uniform_real_distribution<double> place(-45, 45);
  std::normal_distribution<double> noise(0, 0.2);
  SeenPoints points;
  for (int i = 0; i < count; ++i) {
    points.world_mm.emplace_back(place(random), place(random), place(random));
    points.pixels.push_back(project(camera, points.world_mm.back()) + Vector2d(noise(random), noise(random)));
  }
  return points;
}

void expect_explained(const Camera& camera, const SeenPoints& points, const std::string& said) {
  const auto sentence = calibration::explanations({camera}, {points}).at(0);
  ASSERT_TRUE(sentence) << said;
  EXPECT_NE(sentence->find(said), std::string::npos) << *sentence;
  const std::size_t at = sentence->find("only ");
  ASSERT_NE(at, std::string::npos) << *sentence;
  EXPECT_LT(std::stod(sentence->substr(at + 5)), 0.4) << "but for the noise, nothing is left: " << *sentence;
}

TEST(Explanation, NoneForARightCamera) {
  for (double beta : {0.0, 35.0, 90.0}) {
    const Camera camera = camera_at(12, beta);
    EXPECT_FALSE(calibration::explanations({camera}, {points_of(camera)}).at(0));
    EXPECT_NEAR(calibration::reprojection_error_px(camera, points_of(camera)), 0.2 * std::sqrt(2), 0.1);
  }
}

TEST(Explanation, MirroredAndTurnedImages) {
  const Camera camera = camera_at(12, 35);
  const SeenPoints right = points_of(camera);
  SeenPoints points = right;
  for (auto& p : points.pixels) p.x() = 639 - p.x();
  expect_explained(camera, points, "the image is mirrored left to right");
  points = right;
  for (auto& p : points.pixels) p.y() = 511 - p.y();
  expect_explained(camera, points, "the image is upside down");
  points = right;
  for (auto& p : points.pixels) p = Vector2d(639, 511) - p;
  expect_explained(camera, points, "the image is turned by a half");
  points = right;
  for (auto& p : points.pixels) std::swap(p.x(), p.y());
  expect_explained(camera, points, "columns and rows of the seen places are exchanged");
}

TEST(Explanation, FlippedAxesAndUnits) {
  const Camera camera = camera_at(12, 35);
  const char* names[] = {"x", "y", "z"};
  for (int axis = 0; axis < 3; ++axis) {
    SeenPoints points = points_of(camera);
    for (auto& p : points.world_mm) p[axis] = -p[axis];
    expect_explained(camera, points, std::string("the ") + names[axis] + " axis of the points is reversed");
  }
  SeenPoints points = points_of(camera);
  for (auto& p : points.world_mm) p = Vector3d(-p.x(), -p.y(), p.z());
  expect_explained(camera, points, "RAS in place of LPS");
  for (const auto& [unit, factor] :
       std::map<std::string, double>{{"metres", 0.001}, {"centimetres", 0.1}, {"inches", 1 / 25.4}}) {
    points = points_of(camera);
    for (auto& p : points.world_mm) p *= factor;
    expect_explained(camera, points, "the points are in " + unit + ", not mm");
  }
}

TEST(Explanation, WrongPoses) {
  const Camera right = camera_at(12, 35);
  const SeenPoints points = points_of(right);
  Camera camera = right;
  camera.camera_from_world.translation_mm *= 0.001;
  expect_explained(camera, points, "the camera's translation is in metres, not mm");
  camera = right;
  camera.camera_from_world = inverse(right.camera_from_world);
  expect_explained(camera, points, "the camera's pose is given the other way round (world from camera)");
  camera = right;
  camera.camera_from_world.rotation.transposeInPlace();
  expect_explained(camera, points, "the camera's rotation is transposed");
  camera = right;
  camera.camera_from_world.translation_mm = source_position_mm(right);
  expect_explained(camera, points, "the camera's translation is the source's position");
  camera = right;
  camera.camera_from_world.rotation = Vector3d(1, -1, -1).asDiagonal() * right.camera_from_world.rotation;
  camera.camera_from_world.translation_mm = Vector3d(1, -1, -1).cwiseProduct(right.camera_from_world.translation_mm);
  expect_explained(camera, points, "OpenGL's convention");
}

TEST(Explanation, MatrixOfAnImageOfAnotherSize) {
  Camera camera = camera_at(12, 35);
  const SeenPoints points = points_of(camera);
  camera.intrinsics.topRows<2>() *= 0.5;
  camera.intrinsics.topRightCorner<2, 1>().array() -= 0.25;  // pixel u covers 2 u and 2 u + 1
  expect_explained(camera, points, "the camera matrix is that of an image half as large");
}

TEST(Refit, TellsAMovedPoseFromAWrongMatrix) {
  const Camera right = camera_at(12, 35);
  const SeenPoints points = points_of(right);
  Camera camera = right;
  camera.camera_from_world.translation_mm += Vector3d(3, -2, 0);
  camera.camera_from_world.rotation = rotation_from_vector({0, 0, radians(1.5)}) * right.camera_from_world.rotation;
  auto refit = calibration::refit_pose(camera, points);
  ASSERT_TRUE(refit);
  EXPECT_LT(refit->error_px, 0.4);
  EXPECT_NEAR(refit->turn_deg, 1.5, 0.1);
  EXPECT_NEAR(refit->shift_mm, 3.6, 0.5);
  EXPECT_FALSE(calibration::refit_pose(right, points_of(right, 5)));
}

TEST(ImplausibleNumbers, AreNamed) {
  const std::vector<Vector3d> object{{-40, -40, -40}, {40, 40, 40}};
  const auto says = [&](const Camera& camera, const std::string& said, const calibration::Device& device = {},
                        std::vector<Vector3d> points = {}) {
    std::string all;
    for (const auto& sentence : calibration::implausible_numbers(camera, device, points.empty() ? object : points))
      all += sentence + "\n";
    EXPECT_NE(all.find(said), std::string::npos) << "it said: " << all;
  };
  const Camera right = camera_at(0, 0);
  EXPECT_TRUE(calibration::implausible_numbers(right, {1000, 0.5, 330}, object).empty());
  EXPECT_TRUE(calibration::implausible_numbers(right, {}, {}).empty());
  Camera camera = right;
  camera.intrinsics(0, 0) = camera.intrinsics(1, 1) = 100;
  says(camera, "the focal length of 100 px opens an image of 640 px to 145.3 degrees");
  camera = right;
  camera.intrinsics(1, 1) *= 1.5;
  says(camera, "so pixels would not be square");
  camera = right;
  camera.intrinsics.topRightCorner<2, 1>() = Vector2d(639.5, 511.5);
  says(camera, "lies in the middle of an image of 1280 x 1024 pixels, but this one has 640 x 512");
  camera.intrinsics.topRightCorner<2, 1>() = Vector2d(160, 128);
  says(camera, "lies in the middle of an image of 320 x 256 pixels, but this one has 640 x 512");
  camera.intrinsics.topRightCorner<2, 1>() = Vector2d(-30, 256);
  says(camera, "the principal point (-30, 256) lies outside the image");
  says(right, "the focal length is 2000 px, but 1000 mm from source to detector and pixels of 0.3 mm make 3333",
       {1000, 0.3, 0});
  says(right, "the detector is 200 mm wide, smaller than the image says: 320 x 256 mm at 0.5 mm per pixel",
       {0, 0.5, 200});
  says(right, "the detector is 200 mm wide, smaller than the image says", {1000, 0, 200});
  says(right, "the object is 0.1386 mm large; are its coordinates in metres", {},
       {{-0.04, -0.04, -0.04}, {0.04, 0.04, 0.04}});
  camera = right;
  camera.camera_from_world.translation_mm *= 0.001;
  says(camera, "the object is 0.6 mm from the X-ray source");
  camera = right;
  camera.camera_from_world.translation_mm.z() = -600;
  says(camera, "2 of 2 points of the object lie behind the X-ray source");
  says(right, "the object is projected wholly outside the image", {}, {{400, 0, 0}, {440, 0, 0}});
}

struct Ran {
  shipped::Outputs outputs;
  std::vector<std::string> warnings;
  double value(const std::string& name) const {
    const double value = shipped::figure(outputs.at("metrics"), name);
    if (std::isnan(value)) ADD_FAILURE() << "no metric " << name;
    return value;
  }
  List<Picture> pictures() const { return outputs.at("picture").as_list<Picture>(); }
};

Ran run(const List<View>& views, const std::filesystem::path& points, const Mesh* mesh = nullptr) {
  Ran ran;
  Context::Hooks hooks;
  hooks.log = [&](std::string_view text, LogLevel) { ran.warnings.emplace_back(text); };
  shipped::Inputs inputs{{"views", shipped::list(views, "view")}};
  if (mesh) inputs["mesh"] = shipped::item(*mesh);
  ran.outputs = shipped::call("camera.check", inputs, {{"known_points", points.string()}}, Context(hooks));
  return ran;
}

/// Grey views of these cameras, named 'one' and 'two'.
List<View> views_of(const std::vector<Camera>& cameras) {
  List<View> views;
  for (const Camera& camera : cameras) {
    View view{views.empty() ? "one" : "two", {}, camera, {}};
    view.image.pixels = cv::Mat1b(camera.height_px, camera.width_px, std::uint8_t(90));
    view.image.pixels.row(3) = 200;
    views.add(view.name, view);
  }
  return views;
}

/// Numbers as a list in YAML.
std::string list_of(const auto& values) {
  std::string all = "[";
  for (const double value : values) all += (all.size() > 1 ? ", " : "") + std::to_string(value);
  return all + "]";
}

std::string points_text(const List<View>& views, int count, bool with_places) {
  const SeenPoints points = points_of(views[0].camera, count);
  std::string text = "marrow-points: 1\npoints:\n";
  for (int i = 0; i < count; ++i) {
    const Vector3d& p = points.world_mm[std::size_t(i)];
    text += "  - {" + (with_places ? "at_mm: " + list_of(p) + ", " : std::string()) + "seen_px: {";
    for (const View& view : views)
      text += (&view == &views[0] ? "" : ", ") + view.name + ": " + list_of(project(view.camera, p));
    text += "}}\n";
  }
  return text;
}

TEST(CheckNode, RightCamerasNeedNoWarning) {
  const TemporaryFolder folder;
  const List<View> views = views_of({camera_at(5, 0), camera_at(0, 80)});
  for (const bool with_places : {true, false}) {
    put(folder / "points.yaml", points_text(views, 12, with_places));
    const Ran ran = run(views, folder / "points.yaml");
    EXPECT_TRUE(ran.warnings.empty()) << ran.warnings[0];
    EXPECT_LT(ran.value("error"), 1e-4);
    EXPECT_EQ(ran.value("one.points"), 12);
    EXPECT_EQ(ran.value("warnings"), 0);
    EXPECT_EQ(ran.pictures().names(), views.names());
  }
}

// Pixels are twice as high as wide. A camera that is moved by 3 mm along its x or y axis misses each point by 3 mm.
TEST(CheckNode, MillimetresAtTheObjectHoldForPixelsOfAnyShape) {
  const TemporaryFolder folder;
  for (const int axis : {0, 1}) {
    Camera right = camera_at(5, 0);
    right.intrinsics.row(1) *= 0.5;
    put(folder / "points.yaml", points_text(views_of({right}), 12, true));
    Camera moved = right;
    moved.camera_from_world.translation_mm[axis] += 3;
    EXPECT_NEAR(run(views_of({moved}), folder / "points.yaml").value("one.mean_at_object"), 3, 0.1) << axis;
  }
}

TEST(CheckNode, WarnsInWords) {
  const TemporaryFolder folder;
  const Camera first = camera_at(5, 0), second = camera_at(0, 80);
  put(folder / "points.yaml", points_text(views_of({first, second}), 12, true));
  Camera moved = second;
  moved.camera_from_world.translation_mm.x() += 5;
  Ran ran = run(views_of({first, moved}), folder / "points.yaml");
  ASSERT_EQ(ran.warnings.size(), 1u);
  char said[64];
  std::snprintf(said, sizeof said, "view 'two': the points are %.3g px off, but only ", ran.value("two.error"));
  EXPECT_NE(ran.warnings[0].find(said), std::string::npos) << ran.warnings[0];
  EXPECT_NE(ran.warnings[0].find("its inner parameters are right, its pose is not, or the object has moved"),
            std::string::npos)
      << ran.warnings[0];
  EXPECT_NEAR(ran.value("two.mean_at_object"), 5, 0.4);
  EXPECT_LT(ran.value("two.error_with_free_pose"), 1e-3);
  Camera longer = second;
  longer.intrinsics(0, 0) *= 1.05;  // not the other: no pose makes up for it
  ran = run(views_of({first, longer}), folder / "points.yaml");
  ASSERT_EQ(ran.warnings.size(), 1u);
  EXPECT_NE(ran.warnings[0].find(
                "with the best pose: focal length, principal point, distortion or the points themselves are wrong"),
            std::string::npos)
      << ran.warnings[0];
  const List<View> twice = views_of({first, first});
  put(folder / "points.yaml", points_text(twice, 12, true));
  ran = run(twice, folder / "points.yaml");
  ASSERT_EQ(ran.warnings.size(), 1u);
  EXPECT_NE(ran.warnings[0].find("look along nearly the same line"), std::string::npos);
}

TEST(CheckNode, DrawsTheOutlineOfAMesh) {
  const List<View> views = views_of({camera_at(0, 0)});
  Mesh cube;
  cube.frame = "world";
  for (int i = 0; i < 8; ++i) cube.vertices_mm.emplace_back(i & 1 ? 30 : -30, i & 2 ? 30 : -30, i & 4 ? 30 : -30);
  const int quads[6][4] = {{0, 2, 3, 1}, {4, 5, 7, 6}, {0, 1, 5, 4}, {2, 6, 7, 3}, {0, 4, 6, 2}, {1, 3, 7, 5}};
  for (const auto& q : quads) {
    cube.triangles.push_back({std::uint32_t(q[0]), std::uint32_t(q[1]), std::uint32_t(q[2])});
    cube.triangles.push_back({std::uint32_t(q[0]), std::uint32_t(q[2]), std::uint32_t(q[3])});
  }
  ASSERT_TRUE(is_closed(cube));
  const Ran ran = run(views, {}, &cube);
  EXPECT_TRUE(ran.warnings.empty());
  const cv::Mat pixels = ran.pictures()[0].pixels;
  const double scale = 1000 / 640.0;
  const auto is_blue = [&](double u, double v) {
    const auto in_picture = [&](double at_px) { return int(std::lround((at_px + 0.5) * scale - 0.5)); };
    const cv::Vec3b pixel = pixels.at<cv::Vec3b>(in_picture(v), in_picture(u));
    return pixel[2] > pixel[0] + 40;
  };
  // The nearer face is 30 mm behind the isocentre, towards the source: its edges lie at 30 * 2000 / 570 px from the
  // middle.
  const double u = 319.5 + 9, v = 255.5 - 6, half = 30 * 2000 / 570.0;
  for (double along = -half; along <= half; along += 1) {
    EXPECT_TRUE(is_blue(u + half, v + along)) << along;
    EXPECT_TRUE(is_blue(u - half, v + along)) << along;
    EXPECT_TRUE(is_blue(u + along, v + half)) << along;
    EXPECT_TRUE(is_blue(u + along, v - half)) << along;
  }
  int within = 0;
  for (double across = 4 - half; across <= half - 4; across += 0.5)
    for (double down = 4 - half; down <= half - 4; down += 0.5) within += is_blue(u + across, v + down);
  EXPECT_EQ(within, 0) << "of the face towards the source only";
}

TEST(PointsFile, Faults) {
  const TemporaryFolder folder;
  const std::string good = "marrow-points: 1\npoints:\n  - {name: A, at_mm: [1, 2, 3], seen_px: {one: [4, 5]}}\n";
  const auto read = [&](const std::string& text) {
    put(folder / "p.yaml", text);
    return files::read_points_file(folder / "p.yaml");
  };
  EXPECT_EQ(read(good)[0].seen_px.at("one"), Vector2d(4, 5));
  EXPECT_SAYS(read(with(good, "at_mm: [1, 2, 3], ", "")),
              "p.yaml:3:24: point 1: a point without at_mm needs to be seen in two views");
  EXPECT_SAYS(read(with(good, "[4, 5]", "[4]")), "point 1: seen_px: one: expected 2 numbers, got a list of 1");
  EXPECT_SAYS(read(with(good, "{one: [4, 5]}", "[4, 5]")), "expected the point's place per view");
  EXPECT_SAYS(read("marrow-points: 1\npoints: []\n"), "expected a list of points");
  put(folder / "p.yaml", with(good, "one:", "two:"));
  EXPECT_SAYS(run(views_of({camera_at(0, 0)}), folder / "p.yaml"),
              "point 'A' is seen in 'two', but there is no view of that name; there are 'one'");
}

// Twelve metal beads in two frames of a real biplane system. Their places are triangulated from the same pixels.
TEST(CheckNode, RealWristCameras) {
  MARROW_NEED_DATA(data, "wrist");
  const TemporaryFolder folder;
  for (const char* frame : {"0002", "0158"}) {
    List<View> views;
    for (const char* number : {"01", "02"}) {
      View view;
      view.name = std::string("cam") + number;
      view.image =
          files::read_image_file(data / "images" / ("xr_rad_uln_cam" + std::string(number) + "_UND." + frame + ".tif"));
      view.camera =
          files::read_camera_file(data / "cameras" / ("xr_calib_wrist_cam" + std::string(number) + ".txt")).camera;
      views.add(view.name, view);
    }
    std::string text = "marrow-points: 1\npoints:\n";
    for (const auto& cluster : YAML::LoadFile(data / "beads.json")["beads"][frame])
      for (const auto& bead : cluster.second) {
        if (!bead.IsMap() || !bead["xyz_mm"].IsSequence()) continue;
        const auto list = [&](const char* key) { return YAML::Dump(bead[key]); };
        text += "  - {at_mm: " + list("xyz_mm") + ", seen_px: {cam01: " + list("uv_cam01") +
                ", cam02: " + list("uv_cam02") + "}}\n";
      }
    put(folder / "beads.yaml", text);
    const Ran ran = run(views, folder / "beads.yaml");
    for (const char* name : {"cam01", "cam02"})
      std::printf("frame %s, %s: %g beads, rms %.3f px, worst %.3f px, %.3f mm at the beads\n", frame, name,
                  ran.value(name + std::string(".points")), ran.value(name + std::string(".error")),
                  ran.value(name + std::string(".worst")), ran.value(name + std::string(".mean_at_object")));
    EXPECT_TRUE(ran.warnings.empty()) << ran.warnings[0];
    EXPECT_LT(ran.value("error"), 0.4);
    // With mirrored pixels, both cameras get a warning.
    std::string mirrored;
    for (const auto& point : files::read_points_file(folder / "beads.yaml")) {
      mirrored += "  - {at_mm: " + list_of(*point.world_mm) + ", seen_px: {";
      for (const auto& [name, at] : point.seen_px)
        mirrored += (name == "cam01" ? "" : ", ") + name + ": " + list_of(Vector2d(1759 - at.x(), at.y()));
      mirrored += "}}\n";
    }
    put(folder / "beads.yaml", "marrow-points: 1\npoints:\n" + mirrored);
    const Ran found = run(views, folder / "beads.yaml");
    ASSERT_EQ(found.warnings.size(), 2u);
    for (const auto& warning : found.warnings)
      EXPECT_NE(warning.find("if the image is mirrored left to right"), std::string::npos) << warning;
  }
}

}  // namespace check_test
