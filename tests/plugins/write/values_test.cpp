// SPDX-License-Identifier: Apache-2.0
// Surfaces, volumes, pictures and cases are read back as they were written; on a full disk the old file stays.
// What no reader takes is not written: surfaces with wrong corners, and numbers that are not finite.

#include "marrow/toolbox/files/mesh_file.hpp"
#include "marrow/toolbox/files/volume_file.hpp"
#include "marrow/toolbox/geometry/implant.hpp"
#include "marrow/write/picture_out.hpp"
#include "shipped.hpp"
#include "tests/plugins/write/example_case.hpp"
#include "tests/plugins/write/full_disk.hpp"
#include "tests/plugins/write/writing.hpp"

namespace values_test {

using namespace marrow;
using namespace marrow::test;
using writing::write;
using WriteMesh = InAFolder;
using WriteVolume = InAFolder;
using Eigen::Matrix3d, Eigen::Vector3d;
using example_case::example, example_case::example_view;
using WriteCase = InAFolder;
using WriteView = InAFolder;

Mesh surface() {
  return {{{0, 0, 0}, {1.0 / 3, 0, 0}, {0, 1e-9, 0}, {0, 0, 12345.678}},
          {{0, 2, 1}, {0, 1, 3}, {0, 3, 2}, {1, 2, 3}},
          "ct"};
}

Volume volume(int size) {
  Volume value;
  value.grid.size = {size, size, size};
  value.grid.origin_mm = {1, 2, 3};
  for (int i = 0; i < size * size * size; ++i) value.values.push_back(float((i * 7919) % 4001) * 0.37f - 1000);
  return value;
}

cv::Mat noise(int type, double top) {
  cv::Mat pixels(40, 60, type);
  cv::randu(pixels, 0, top);
  return pixels;
}

TEST_F(WriteMesh, ReadsBackTheSameToTheLastBit) {
  write(surface(), folder / "m.ply");
  EXPECT_EQ(hash_of(files::read_mesh_file(folder / "m.ply", 1)), hash_of(surface()));
  Mesh odd = surface();
  odd.frame = "ct\nelement vertex 1000000\r\x1b[2J";
  write(odd, folder / "m.ply");
  EXPECT_EQ(files::read_mesh_file(folder / "m.ply", 1).vertices_mm.size(), 4u) << "the frame adds nothing";
}

TEST_F(WriteVolume, ReadsBackTheSame) {
  const Volume written = volume(9);
  write(written, folder / "ct.mha");
  EXPECT_EQ(hash_of(files::read_volume_file(folder / "ct.mha", {})), hash_of(written));
  write(SignedField{written.grid, written.values}, folder / "field.mha");
  EXPECT_EQ(files::read_volume_file(folder / "field.mha", {}).values, written.values);
  EXPECT_SAYS(write(Volume(), folder / "empty.mha"), "the volume is empty");
  EXPECT_FALSE(std::filesystem::exists(folder / "empty.mha"));
}

class WritePicture : public InAFolder {
 protected:
  template <class T>
  cv::Mat written(const T& value) {
    write(value, folder / "a.png");
    return files::read_image_file(folder / "a.png").pixels;
  }
};

TEST_F(WritePicture, KeepsTheBitsOfAnImageAndScalesFloat) {
  for (const cv::Mat& pixels : {noise(CV_8U, 255), noise(CV_16U, 65535)})
    EXPECT_EQ(hash_of(Image{written(Image{pixels})}), hash_of(Image{pixels}));
  // A part of a larger image has gaps between its rows.
  const cv::Mat part = noise(CV_16U, 65535)(cv::Rect(3, 4, 20, 10));
  EXPECT_EQ(cv::countNonZero(written(Image{part}) != part), 0);
  const cv::Mat read = written(Image{(cv::Mat_<float>(1, 3) << -2, 0, 2)});
  EXPECT_EQ(read.at<std::uint16_t>(0, 0), 0);
  EXPECT_NEAR(read.at<std::uint16_t>(0, 1), 32768, 1);
  EXPECT_EQ(read.at<std::uint16_t>(0, 2), 65535);
  EXPECT_EQ(written(Image{cv::Mat(2, 2, CV_32F, cv::Scalar(7))}).at<std::uint16_t>(1, 1), 0);
}

TEST_F(WritePicture, EdgesColoursAndFaults) {
  const cv::Mat read = written(EdgeMap{6, 4, {{2.4f, 1.6f, 1, 0, 50}, {-3, 0, 1, 0, 50}, {5.4f, 3.4f, 0, 1, 9}}});
  EXPECT_EQ(cv::countNonZero(read), 2);
  EXPECT_EQ(read.at<std::uint8_t>(2, 2), 255);
  EXPECT_EQ(read.at<std::uint8_t>(3, 5), 255);
  EXPECT_SAYS(written(Picture{noise(CV_8UC3, 255)}), "has colours: the pixel at column 1 of row 1 has red");
  EXPECT_SAYS(write(Picture(), folder / "q.png"), "q.png: the image is empty, there is nothing to write");
  EXPECT_FALSE(std::filesystem::exists(folder / "q.png"));
}

TEST_F(WritePicture, FloatTiffIsWholeOrAnError) {
  const cv::Mat pixels = noise(CV_32F, 1);
  marrow::write::write_pixels(folder / "whole.tif", pixels);
  EXPECT_EQ(cv::countNonZero(files::read_image_file(folder / "whole.tif").pixels != pixels), 0);
  const auto size = std::filesystem::file_size(folder / "whole.tif");
  for (const std::uintmax_t bytes : {std::uintmax_t(0), size / 2, size - 100, size - 1}) {
    const FullDisk full(bytes);
    EXPECT_SAYS((marrow::write::write_pixels(folder / "half.tif", pixels), 0), "half.tif: cannot be written");
  }
}

template <class T>
void expect_full_disk_is_diagnosed(const std::string& name, const std::vector<rlim_t>& limits, const T& value) {
  const TemporaryFolder folder;
  for (const rlim_t bytes : limits)
    test::expect_full_disk_is_diagnosed(folder, name, bytes, [&](const std::string& path) { write(value, path); });
}

TEST(WriteValues, OnAFullDiskKeepTheOldFile) {
  expect_full_disk_is_diagnosed("m.ply", {0, 100, 300}, surface());
  expect_full_disk_is_diagnosed("ct.mha", {0, 100, 5000}, volume(20));
  expect_full_disk_is_diagnosed("a.png", {0, 60, 4000}, Image{noise(CV_16U, 65535)});
  Pose pose;
  pose.warnings = {std::string(100, 'x')};
  expect_full_disk_is_diagnosed("p.yaml", {0, 200}, pose);
}

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
      EXPECT_HAS(shipped::refusal(std::string("write.") + format, {{"mesh", shipped::item(mesh)}}),
                 std::string("the surface cannot be written as .") + format + ": " + text);
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

TEST_F(WriteCase, ReplacesAnEarlierOneAndWritesTheSameBytes) {
  const Case value = example();
  for (const char* name : {"case", "other", "case"}) write(value, folder / name);
  int files = 0;
  for (const auto& entry : std::filesystem::directory_iterator(folder / "case")) {
    EXPECT_EQ(bytes_of(entry.path()), bytes_of(folder / "other" / entry.path().filename().string()));
    ++files;
  }
  EXPECT_EQ(files, 1 + 1 + 3 + 3 + 1);
  int folders = 0;
  for ([[maybe_unused]] const auto& entry : std::filesystem::directory_iterator(folder.path())) ++folders;
  EXPECT_EQ(folders, 2) << "nothing temporary is left";
}

TEST_F(WriteCase, TextOfTheCase) {
  Case value = example();
  value.seeds = {};
  value.seeds.add("null", {"null", {{1, 2, 3}}, false});
  value.seeds.add("a: \"b\"", {"a: \"b\"", {{0.1, 0.2, 0.3}, {1e-9, -1, 4}}, true});
  value.start = {};
  value.start.add("a: \"b\"", Pose{});
  value.truth = {};
  value.truth.add("a: \"b\"", {{"world", "ct", Matrix3d::Identity(), {1, 2, 3}}});
  write(value, folder / "case");
  EXPECT_EQ(bytes_of(folder / "case/case.yaml"), R"(marrow-case: 1
ct: ct.mha
views:
  - name: "frontal"
    image: frontal.png
    camera: frontal.camera.yaml
  - name: "lateral"
    image: lateral.png
    camera: lateral.camera.yaml
  - name: "60 degrees / oblique"
    image: view-3.tif
    camera: view-3.camera.yaml
    mask: view-3.mask.png
fragments:
  "null":
    seeds:  # mm, in CT coordinates
      - [1, 2, 3]
    register: false
  "a: \"b\"":
    seeds:  # mm, in CT coordinates
      - [0.1, 0.2, 0.3]
      - [1e-09, -1, 4]
    register: true
    start:
      target: world
      source: ct
      matrix:  # world_from_ct, mm
        - [1, 0, 0, 0]
        - [0, 1, 0, 0]
        - [0, 0, 1, 0]
        - [0, 0, 0, 1]
    truth:
      target: world
      source: ct
      matrix:  # world_from_ct, mm
        - [1, 0, 0, 1]
        - [0, 1, 0, 2]
        - [0, 0, 1, 3]
        - [0, 0, 0, 1]
)");
}

TEST_F(WriteCase, DiagnosesWhatReadCaseWouldNotTake) {
  const auto expect = [&](void (*change)(Case&), const std::string& said) {
    Case value = example();
    change(value);
    EXPECT_SAYS(write(value, folder / "case"), said);
  };
  expect([](Case& c) { c.start.add("middle", Pose{}); }, "case: fragment 'middle' has a start but no seeds");
  expect([](Case& c) { c.views = {}; }, "case: the case has no view");
  expect([](Case& c) { c.views.add("frontal", example_view("frontal", CV_8U, 0)); },
         "case: two views are named 'frontal'");
  expect([](Case& c) { c.views.add("Frontal", example_view("Frontal", CV_8U, 0)); },
         "case: the views 'frontal' and 'Frontal' are the same file on some file systems; rename one of them");
  expect(
      [](Case& c) {
        c.seeds.add("distal", {"distal", {{1, 2, 3}}, false});
      },
      "case: two fragments are named 'distal'");
  expect([](Case& c) { c.views.add("a\nb", example_view("a\nb", CV_8U, 0)); },
         "case: the name 'a\\x0ab' of a view holds a character that cannot be printed; choose another");
  expect(
      [](Case& c) {
        c.seeds.add("", {"", {{1, 2, 3}}, false});
      },
      "case: the name '' of a fragment is empty; choose another");
  expect([](Case& c) { c.ct.values.pop_back(); }, ": ct: 24 voxels expected from its size, got 23");
  EXPECT_FALSE(std::filesystem::exists(folder / "case"));
  Case value = example();
  value.views = {};
  for (const char* name : {"View-2", "a/b"}) value.views.add(name, example_view(name, CV_8U, 0));
  write(value, folder / "other");
  EXPECT_TRUE(std::filesystem::exists(folder / "other/View-2.png"));
  EXPECT_TRUE(std::filesystem::exists(folder / "other/view-3.png"));
}

TEST_F(WriteCase, FullDiskLeavesNothing) {
  const auto path = folder / "case";
  {
    const FullDisk full(120);
    EXPECT_SAYS(write(example(), path), "cannot be written");
  }
  EXPECT_TRUE(std::filesystem::is_empty(folder.path()));
}

TEST_F(WriteView, FolderWithImageAndCamera) {
  write(example_view("frontal", CV_16U, 0), folder / "frontal");
  EXPECT_TRUE(std::filesystem::exists(folder / "frontal/image.png"));
  EXPECT_TRUE(std::filesystem::exists(folder / "frontal/camera.yaml"));
  EXPECT_FALSE(std::filesystem::exists(folder / "frontal/mask.png"));
}

}  // namespace values_test
