// SPDX-License-Identifier: Apache-2.0
#include "marrow/camera/points_file.hpp"
#include "marrow/toolbox/files/camera_file.hpp"
#include "marrow/toolbox/files/volume_file.hpp"
#include "tests/plugins/read/damage.hpp"
#include "tests/plugins/read/reading.hpp"

namespace check_test {

using namespace marrow;
using namespace marrow::test;
using Eigen::Vector3d, Eigen::Vector2d;
using CheckNode = InAFolder;
using PointsFile = InAFolder;

Camera camera_at(double alpha_deg, double beta_deg) {
  CArm arm{640, 512, {0.5, 0.5}, 1000, 600, Vector3d::Zero()};
  Camera camera = carm_camera(arm, world_from_camera_rotation(radians(alpha_deg), radians(beta_deg)));
  camera.intrinsics(0, 2) += 9;
  camera.intrinsics(1, 2) -= 6;
  return camera;
}

/// Points spread over the field.
std::vector<Vector3d> points_of(int count) {
  std::mt19937_64 random(3);
  std::uniform_real_distribution<double> place(-45, 45);
  std::vector<Vector3d> points;
  for (int i = 0; i < count; ++i) points.emplace_back(place(random), place(random), place(random));
  return points;
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
  shipped::Inputs inputs{{"views", shipped::list(views, "view")}};
  if (mesh) inputs["mesh"] = shipped::item(*mesh);
  ran.warnings = said_by([&](const Context& context) {
    ran.outputs = shipped::call("camera.check", inputs, {{"known_points", points.string()}}, context);
  });
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
  std::string text = "marrow-points: 1\npoints:\n";
  for (const Vector3d& p : points_of(count)) {
    text += "  - {" + (with_places ? "at_mm: " + list_of(p) + ", " : std::string()) + "seen_px: {";
    for (const View& view : views)
      text += (&view == &views[0] ? "" : ", ") + view.name + ": " + list_of(project(view.camera, p));
    text += "}}\n";
  }
  return text;
}

TEST_F(CheckNode, RightCamerasNeedNoWarning) {
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
TEST_F(CheckNode, MillimetresAtTheObjectHoldForPixelsOfAnyShape) {
  for (const int axis : {0, 1}) {
    Camera right = camera_at(5, 0);
    right.intrinsics.row(1) *= 0.5;
    put(folder / "points.yaml", points_text(views_of({right}), 12, true));
    Camera moved = right;
    moved.camera_from_world.translation_mm[axis] += 3;
    EXPECT_NEAR(run(views_of({moved}), folder / "points.yaml").value("one.mean_at_object"), 3, 0.1) << axis;
  }
}

TEST_F(CheckNode, WarnsInWords) {
  const Camera first = camera_at(5, 0), second = camera_at(0, 80);
  put(folder / "points.yaml", points_text(views_of({first, second}), 12, true));
  Camera moved = second;
  moved.camera_from_world.translation_mm.x() += 5;
  Ran ran = run(views_of({first, moved}), folder / "points.yaml");
  ASSERT_EQ(ran.warnings.size(), 1u);
  char said[64];
  std::snprintf(said, sizeof said, "view 'two': the points are %.3g px off, but only ", ran.value("two.error"));
  EXPECT_HAS(ran.warnings[0], said);
  EXPECT_HAS(ran.warnings[0], "its inner parameters are right, its pose is not, or the object has moved");
  EXPECT_NEAR(ran.value("two.mean_at_object"), 5, 0.4);
  EXPECT_LT(ran.value("two.error_with_free_pose"), 1e-3);
  Camera longer = second;
  longer.intrinsics(0, 0) *= 1.05;  // not the other: no pose makes up for it
  ran = run(views_of({first, longer}), folder / "points.yaml");
  ASSERT_EQ(ran.warnings.size(), 1u);
  EXPECT_HAS(ran.warnings[0],
             "with the best pose: focal length, principal point, distortion or the points themselves are wrong");
  const List<View> twice = views_of({first, first});
  put(folder / "points.yaml", points_text(twice, 12, true));
  ran = run(twice, folder / "points.yaml");
  ASSERT_EQ(ran.warnings.size(), 1u);
  EXPECT_HAS(ran.warnings[0], "look along nearly the same line");
}

TEST_F(CheckNode, DrawsTheOutlineOfAMesh) {
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

TEST_F(PointsFile, Faults) {
  const std::string good = "marrow-points: 1\npoints:\n  - {name: A, at_mm: [1, 2, 3], seen_px: {one: [4, 5]}}\n";
  expect_faults(
      folder / "p.yaml", good,
      {{"at_mm: [1, 2, 3], ", "", "p.yaml:3:24: point 1: a point without at_mm needs to be seen in two views"},
       {"[4, 5]", "[4]", "point 1: seen_px: one: expected 2 numbers, got a list of 1"},
       {"{one: [4, 5]}", "[4, 5]", "expected the point's place per view"},
       {"", "marrow-points: 1\npoints: []\n", "expected a list of points"}},
      files::read_points_file);
  EXPECT_EQ(files::read_points_file(folder / "p.yaml")[0].seen_px.at("one"), Vector2d(4, 5));
  put(folder / "p.yaml", with(good, "one:", "two:"));
  EXPECT_SAYS(run(views_of({camera_at(0, 0)}), folder / "p.yaml"),
              "point 'A' is seen in 'two', but there is no view of that name; there are 'one'");
}

// Twelve metal beads in two frames of a real biplane system. Their places are triangulated from the same pixels.
TEST_F(CheckNode, RealWristCameras) {
  MARROW_NEED_DATA(data, "wrist");
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
    for (const auto& warning : found.warnings) EXPECT_HAS(warning, "if the image is mirrored left to right");
  }
}

}  // namespace check_test
