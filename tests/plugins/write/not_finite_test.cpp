// SPDX-License-Identifier: Apache-2.0
// What no reader takes is not written: surfaces with wrong corners, and numbers that are not finite.

#include <limits>

#include "marrow/domain/scene.hpp"
#include "marrow/toolbox/geometry/implant.hpp"
#include "marrow/write/picture_out.hpp"
#include "shipped.hpp"
#include "tests/plugins/write/full_disk.hpp"
#include "tests/plugins/write/writing.hpp"

namespace not_finite_test {

using namespace marrow;
using namespace marrow::test;
using Eigen::Vector3d;
using writing::write;

constexpr double kNone = std::numeric_limits<double>::quiet_NaN();

Mesh good() {
  return {{{0, 0, 0}, {10, 0, 0}, {0, 20, 0}, {0, 0, 30}}, {{0, 2, 1}, {0, 1, 3}, {0, 3, 2}, {1, 2, 3}}, "ct"};
}

/// The surfaces that every writer must refuse, with the messages.
std::vector<std::pair<Mesh, std::string>> bad_meshes() {
  std::vector<std::pair<Mesh, std::string>> meshes;
  Mesh mesh = good();
  mesh.triangles[1][2] = 9;
  meshes.emplace_back(mesh, "a triangle names vertex 9, but there are only 4");
  mesh = good();
  mesh.vertices_mm[2].y() = kNone;
  meshes.emplace_back(mesh, "a vertex is not finite");
  mesh.vertices_mm[2].y() = std::numeric_limits<double>::infinity();
  meshes.emplace_back(mesh, "a vertex is not finite");
  meshes.emplace_back(Mesh{}, "the surface has no triangles");
  return meshes;
}

/// Writing is refused in these words, and leaves nothing behind.
template <class T>
void expect_refused(const TemporaryFolder& folder, const T& value, const std::string& name, const std::string& text) {
  EXPECT_SAYS((write(value, folder / name), 0), (folder / name).string() + ": " + text);
  EXPECT_TRUE(std::filesystem::is_empty(folder.path())) << name;
}

TEST(WriteNotFinite, Surfaces) {
  const TemporaryFolder folder;
  for (const auto& [mesh, text] : bad_meshes()) {
    expect_refused(folder, mesh, "a.ply", text);
    expect_refused(folder, geometry::Implant{mesh, {{"a", {0, 0, 0}, {1, 0, 0}, 5}}}, "nail", text);
    Scene scene;
    scene.models.push_back({"bone", mesh});
    EXPECT_SAYS((write(scene, folder / "scene.json"), 0), "model 'bone' of a scene: " + text);
    for (const char* format : {"obj", "vtp"})
      EXPECT_NE(shipped::refusal(std::string("write.") + format, {{"mesh", shipped::item(mesh)}})
                    .find(std::string("the surface cannot be written as .") + format + ": " + text),
                std::string::npos);
  }
}

Volume volume_with(float value) {
  Volume volume;
  volume.grid.size = {3, 4, 5};
  volume.values.assign(60, 100);
  volume.values[1 + 3 * (2 + 4 * 3)] = value;
  return volume;
}

TEST(WriteNotFinite, Volumes) {
  const TemporaryFolder folder;
  for (const float value : {float(kNone), std::numeric_limits<float>::infinity()}) {
    const Volume volume = volume_with(value);
    expect_refused(folder, volume, "ct.mha", "voxel (1, 2, 3) is not a finite number; replace NaN and infinities");
    expect_refused(folder, SignedField{volume.grid, volume.values}, "field.mha",
                   "cannot be written, because voxel (1, 2, 3) is not a finite number");
  }
}

View view_with(float value) {
  View view;
  view.name = "ap";
  view.image.pixels = cv::Mat(4, 5, CV_32F, cv::Scalar(1));
  view.image.pixels.at<float>(2, 3) = value;
  view.camera = {5, 4, Vector3d(10, 10, 1).asDiagonal(), {"camera", "world"}};
  return view;
}

TEST(WriteNotFinite, Images) {
  const TemporaryFolder folder;
  const std::string text = "cannot be written, because pixel (3, 2) is not a finite number; replace NaN and infinities";
  for (const float value : {float(kNone), -std::numeric_limits<float>::infinity()}) {
    const View view = view_with(value);
    expect_refused(folder, view.image, "a.png", text);
    EXPECT_SAYS((write(view, folder / "view"), 0), "pixel (3, 2) is not a finite number");
    EXPECT_SAYS((write::write_pixels(folder / "a.tif", view.image.pixels), 0), text);
  }
  expect_refused(folder, EdgeMap{6, 4, {{float(kNone), 1, 1, 0, 50}}}, "edges.png",
                 "cannot be written, because the place of an edge is not a finite number");
}

TEST(WriteNotFinite, Cases) {
  const TemporaryFolder folder;
  Case one;
  one.ct = volume_with(float(kNone));
  one.views.add("ap", view_with(1));
  one.seeds.add("distal", {});
  expect_refused(folder, one, "case", "ct: voxel (1, 2, 3) is not a finite number");
}

TEST(WriteNotFinite, PosesAndCameras) {
  const TemporaryFolder folder;
  Pose pose;
  pose.world_from_model.translation_mm.x() = kNone;
  expect_refused(folder, pose, "pose.yaml", "the transform has a number that is not finite");
  expect_refused(folder, Truth{pose.world_from_model}, "truth.yaml", "the transform has a number that is not finite");
  Camera camera = view_with(1).camera;
  camera.camera_from_world.translation_mm.x() = kNone;
  expect_refused(folder, camera, "camera.yaml", "the transform has a number that is not finite");
  EXPECT_EQ(shipped::refusal("write.tfm", {{"pose", shipped::item(pose)}}),
            "the pose cannot be written as .tfm: the transform has a number that is not finite");
  List<Camera> cameras;
  cameras.add("ap", camera);
  for (const char* node : {"write.rtk", "write.xreg"})
    EXPECT_EQ(
        shipped::refusal(node, {{"cameras", shipped::list(cameras, "view")}}, {{"pixel_mm", std::vector<double>{1}}}),
        "the camera of 'ap': the transform has a number that is not finite");
  Scene scene;
  scene.placements.push_back({"bone", "result", pose.world_from_model});
  EXPECT_SAYS((write(scene, folder / "scene.json"), 0),
              "pose 'result' of a scene: the transform has a number that is not finite");
}

TEST(WriteNotFinite, PointsOf3dSlicer) {
  const Seeds seeds{"distal", {{1, 2, 3}, {1, kNone, 3}}};
  for (const char* node : {"write.markups", "write.fcsv"})
    EXPECT_EQ(shipped::refusal(node, {{"seeds", shipped::item(seeds)}}),
              "point 'distal-2' has a coordinate that is not a finite number");
}

}  // namespace not_finite_test
