// SPDX-License-Identifier: Apache-2.0
#include "marrow/toolbox/exchange/written_files.hpp"
#include "marrow/toolbox/exchange/xreg_file.hpp"
#include "tests/plugins/toolbox/exchange/values.hpp"

namespace xreg_test {

using namespace marrow;
using namespace marrow::test;
using Eigen::Vector3d, Eigen::Vector2d;
using exchange::XregFile, exchange::XregProjection;
using Xreg = InAFolder;

// Made with h5py as xReg lays its files out, with a projection in each of the three frames of cameras, images of 200 x
// 160 pixels, f = 2000 px and pixels of 0.5 mm. The camera is 800 mm from the origin.
const std::filesystem::path kFile = kData / "xreg-by-h5py.h5";

Camera read(const std::filesystem::path& path, int projection, const std::string& mirror) {
  return read_by<Camera>("read.camera", path, {{"projection", (long long)(projection)}, {"mirror", mirror}});
}

// In all three frames (10, -20, 0) is seen 2000 * 10 / 800 = 25 px right of the middle (99.5, 79.5) and 50 px above it.
TEST_F(Xreg, PointsByHandInAllFrames) {
  const Vector3d point(10, -20, 0);
  const Camera from_source = read(kFile, 0, "none");
  EXPECT_EQ(from_source.width_px, 200);
  EXPECT_EQ(from_source.height_px, 160);
  EXPECT_LT((project(from_source, point) - Vector2d(124.5, 29.5)).norm(), 1e-9);
  EXPECT_LT((source_position_mm(from_source) - Vector3d(0, 0, -800)).norm(), 1e-9);
  for (const int projection : {1, 2}) {  // seen from the detector
    EXPECT_LT((project(read(kFile, projection, "left_right"), point) - Vector2d(199 - 124.5, 29.5)).norm(), 1e-9);
    EXPECT_LT((project(read(kFile, projection, "upside_down"), point) - Vector2d(124.5, 159 - 29.5)).norm(), 1e-9);
    EXPECT_LT((source_position_mm(read(kFile, projection, "left_right")) - Vector3d(0, 0, 800)).norm(), 1e-9);
    EXPECT_SAYS(read(kFile, projection, "none"),
                "its images are seen from the detector, or have their rows from below");
  }
  EXPECT_SAYS(read(kFile, 0, "left_right"),
              "projection 0: its images are seen from the source as marrow's are; leave mirror out");
  EXPECT_SAYS(read(kFile, 3, "none"), "has 3 projections, counted from 0; there is no projection 3");
}

List<Camera> cameras_at(const std::filesystem::path& path, shipped::Options options) {
  options["path"] = path.string();
  return shipped::call("read.cameras", {}, options).at("cameras").as_list<Camera>();
}

TEST_F(Xreg, SeveralProjectionsAtOnce) {
  const shipped::Options both{{"names", std::vector<std::string>{"ap", "lateral"}},
                              {"projections", std::vector<double>{2, 1}},
                              {"mirror", "left_right"}};
  const auto cameras = cameras_at(kFile, both);
  EXPECT_EQ(cameras.names(), (std::vector<std::string>{"ap", "lateral"}));
  EXPECT_EQ(hash_of(cameras[0]), hash_of(read(kFile, 2, "left_right")));
  EXPECT_EQ(hash_of(cameras[1]), hash_of(read(kFile, 1, "left_right")));
  const auto first = cameras_at(kFile, {{"names", std::vector<std::string>{"ap"}}});
  EXPECT_EQ(hash_of(first[0]), hash_of(read(kFile, 0, "none")));
  const auto refusal = [&](const std::string& option, const shipped::Options::mapped_type& value) {
    shipped::Options options = both;
    options[option] = value;
    options["path"] = kFile.string();
    return shipped::refusal("read.cameras", {}, options);
  };
  EXPECT_HAS(refusal("projections", std::vector<double>{2, 3}), "there is no projection 3");
  EXPECT_HAS(refusal("projections", std::vector<double>{2, 0.5}),
             "projections: expected whole numbers from 0, got 0.500000");
  EXPECT_HAS(refusal("image_size_px", std::vector<double>{2, 3}),
             "says itself how large its images are; leave out image_size_px");
  EXPECT_HAS(shipped::refusal("read.cameras", {}, {{"path", "a.txt"}, {"names", std::vector<std::string>{"a"}}}),
             "a.txt: expected RTK's geometry (.xml) or xReg's projection data (.h5)");
}

Landmarks landmarks_at(const std::filesystem::path& points, shipped::Options options) {
  options["path"] = points.string();
  return shipped::call("read.landmarks", {}, options).at("landmarks").as_list<Landmarks>()[0];
}

const std::string kPoints =
    "# Markups fiducial file version = 4.6\n# CoordinateSystem = 0\n"
    "# columns = id,x,y,z,ow,ox,oy,oz,vis,sel,lock,label,desc,associatedNodeID\n"
    ",1,2,3,0,0,0,1,1,1,0,FH-l,,\n,4,5,6,0,0,0,1,1,1,0,FH-r,,\n";

TEST_F(Xreg, LandmarksAsImagesShowThem) {
  put(folder / "p.fcsv", kPoints);
  const std::vector<std::string> views{"ap", "lateral", "oblique"};
  const Landmarks landmarks =
      landmarks_at(folder / "p.fcsv", {{"seen", kFile.string()}, {"names", views}, {"mirror", "left_right"}});
  EXPECT_EQ(landmarks.points[0].model_mm, Vector3d(-1, -2, 3));
  ASSERT_EQ(landmarks.seen.size(), 6u);
  EXPECT_EQ(landmarks.seen[3].name, "FH-r");
  EXPECT_EQ(landmarks.seen[3].view, "lateral");
  EXPECT_EQ(landmarks.seen[3].pixel, Vector2d(199 - 10.25, 20.5));
  EXPECT_EQ(landmarks_at(folder / "p.fcsv", {{"seen", kFile.string()}, {"names", views}}).seen[0].pixel,
            Vector2d(124.5, 29.5));
  EXPECT_SAYS(landmarks_at(folder / "p.fcsv", {{"seen", kFile.string()}}),
              "xreg-by-h5py.h5: has 3 projections; give as many names, got 0");
  put(folder / "p.fcsv", with(kPoints, "FH-r", "GSN-r"));
  EXPECT_SAYS(landmarks_at(folder / "p.fcsv", {{"seen", kFile.string()}, {"names", views}}),
              "xreg-by-h5py.h5: projection 0 shows 'FH-r', but ");
  EXPECT_SAYS(landmarks_at(folder / "p.fcsv", {{"names", views}}),
              "p.fcsv: names and mirror are about the file of seen; give it, or leave them out");
  put(folder / "l.yaml", "marrow-landmarks: 1\nfragments: {a: {points: {b: [1, 2, 3]}}}\n");
  EXPECT_SAYS(
      landmarks_at(folder / "l.yaml", {{"seen", kFile.string()}}),
      "l.yaml: says itself where views show the landmarks; seen is only for points of 3D Slicer, so leave it out");
}

List<Camera> cameras() {
  List<Camera> all;
  for (const char* name : {"frontal", "lateral"}) {
    Camera camera{640, 480, {}, {"camera", "world"}};
    camera.intrinsics << 2500, 0.25, 300.25, 0, 2000, 251, 0, 0, 1;
    camera.camera_from_world.rotation = rotation_from_vector({0.3, -0.5, 0.8 + double(all.size())});
    camera.camera_from_world.translation_mm = {10, -20, 700};
    all.add(name, camera);
  }
  return all;
}

const Landmarks kLandmarks{{{"head", {1, 2, 3}}}, {{"head", "lateral", {100.25, 1.0 / 3}}}, {}};

std::string write(const std::filesystem::path& path) {
  const auto outputs = shipped::call(
      "write.xreg", {{"cameras", shipped::list(cameras(), "view")}, {"landmarks", shipped::item(kLandmarks)}},
      {{"pixel_mm", std::vector<double>{0.4, 0.5}}});
  writing::write(outputs.at("projections").as<XregFile>(), path);
  return bytes_of(path);
}

TEST_F(Xreg, WhatIsWrittenIsReadBackToTheLastBit) {
  const std::string bytes = write(folder / "a.h5");
  for (int i = 0; i < 2; ++i) EXPECT_EQ(hash_of(read(folder / "a.h5", i, "none")), hash_of(cameras()[std::size_t(i)]));
  const std::vector<XregProjection> projections = exchange::read_xreg(folder / "a.h5");
  EXPECT_TRUE(projections[0].landmarks.empty());
  ASSERT_EQ(projections[1].landmarks.size(), 1u);
  EXPECT_EQ(projections[1].landmarks[0].name, "head");
  EXPECT_EQ(projections[1].landmarks[0].pixel, kLandmarks.seen[0].pixel);
  EXPECT_EQ(projections[1].column_spacing_mm, 0.4);
  EXPECT_EQ(projections[1].row_spacing_mm, 0.5);
  EXPECT_EQ(write(folder / "b.h5"), bytes) << "the same bytes again";
}

TEST_F(Xreg, DiagnosesWhatCannotBeWritten) {
  Landmarks landmarks = kLandmarks;
  const auto refusal = [&] {
    return shipped::refusal("write.xreg",
                            {{"cameras", shipped::list(cameras(), "view")}, {"landmarks", shipped::item(landmarks)}},
                            {{"pixel_mm", std::vector<double>{0.4, 0.5}}});
  };
  landmarks.seen[0].view = "oblique";
  EXPECT_HAS(refusal(), "landmark 'head' is seen in view 'oblique', which has no camera here; wire all cameras");
  landmarks.seen[0] = {"a/b", "lateral", {1, 2}};
  EXPECT_HAS(refusal(), "landmark 'a/b': a file of xReg cannot hold a name with '/'; rename it");
}

TEST_F(Xreg, DiagnosesFaults) {
  const auto good = exchange::read_xreg(kFile);
  const auto expect = [&](const auto& change, const std::string& said) {
    std::vector<XregProjection> projections = good;
    change(projections[0]);
    put(folder / "a.h5", exchange::xreg_bytes(projections));
    EXPECT_REFUSED(read(folder / "a.h5", 0, "none"), "a.h5", said);
  };
  using P = XregProjection;
  expect([](P& p) { p.frame = "origin-at-isocentre"; },
         "a.h5: proj-000/cam/cam-coord-frame-type: expected origin-at-focal-pt-det-pos-z, origin-at-focal-pt-det-neg-z "
         "or origin-on-det, got 'origin-at-isocentre'");
  expect([](P& p) { p.height_px = 0; }, "a.h5: proj-000/cam/num-rows: expected 1 to 65536 pixels, got 0");
  expect([](P& p) { p.width_px = 70000; }, "a.h5: proj-000/cam/num-cols: expected 1 to 65536 pixels, got 70000");
  expect([](P& p) { p.row_spacing_mm = 0; },
         "a.h5: proj-000/cam/row-spacing: expected the size of a pixel in mm, between 1e-6 and 1000, got 0");
  expect([](P& p) { p.column_spacing_mm = std::nan(""); },
         "a.h5: proj-000/cam/col-spacing: expected finite numbers, got nan");
  expect([](P& p) { p.intrinsic(2, 2) = 2; },
         "a.h5: proj-000/cam/intrinsic: expected the rows (f, s, u), (0, f, v), (0, 0, 1); the file is damaged");
  expect([](P& p) { p.intrinsic(0, 0) = 1e12; },
         "a.h5: proj-000/cam/intrinsic: expected numbers of at most 1e9, got 1000");
  expect([](P& p) { p.intrinsic(0, 0) = 0; }, "its matrix does not project along rays from a source; it is damaged");
  expect([](P& p) { p.extrinsic(0, 0) = 2; },
         "a.h5: proj-000/cam/extrinsic: expected a rotation and a translation as a 4x4 matrix; the file is damaged");
  expect([](P& p) { p.landmarks[0].pixel.x() = 1e8; },
         "a.h5: proj-000/landmarks/FH-l: expected a column and a row of at most 1e6, got 100000000");
  put(folder / "a.h5", "no HDF5");
  EXPECT_REFUSED(read(folder / "a.h5", 0, "none"), "a.h5",
                 "is no HDF5 file that can be opened; it is cut off, damaged or");
  put(folder / "a.h5", exchange::xreg_bytes({}));
  EXPECT_REFUSED(read(folder / "a.h5", 0, "none"), "a.h5", "num-projs: expected 1 to 10000 projections, got 0");
  const std::string bytes = bytes_of(kFile);
  put(folder / "a.h5", with(bytes, "num-projs", "num-proja"));
  EXPECT_REFUSED(read(folder / "a.h5", 0, "none"), "a.h5",
                 "num-projs: is missing; the file is cut off, or of another kind");
  put(folder / "a.h5", bytes.substr(0, bytes.size() / 2));
  EXPECT_REFUSED(read(folder / "a.h5", 0, "none"), "a.h5", "is no HDF5 file that can be opened");
}

/// Nothing that a damaged file says may make the reader crash, take much memory, or fail without the file's name. HDF5
/// itself reads the file, so this is about what it lets through.
TEST_F(Xreg, DamagedFilesAreRefused) {
  const std::string bytes = write(folder / "good.h5");
  expect_handled(folder, {"a.h5", bytes, bytes.size(), {}, true}, [](const auto& path) { read(path, 0, "none"); },
                 {.cuts = 60, .changes = 300, .memory = 256 << 20, .least_refused = 60});
}

}  // namespace xreg_test
