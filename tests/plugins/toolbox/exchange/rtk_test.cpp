// SPDX-License-Identifier: Apache-2.0
#include "marrow/toolbox/exchange/written_files.hpp"
#include "tests/plugins/toolbox/exchange/values.hpp"

namespace rtk_test {

using namespace marrow;
using namespace marrow::test;
using Eigen::Vector3d, Eigen::Vector2d;
using exchange::RtkFile;
using Rtk = InAFolder;

/// A file with one projection.
std::string file(const std::string& elements, const std::string& matrix = "") {
  return rtk_geometry("  <Projection>\n    " + elements + "\n    " + matrix + "\n  </Projection>\n");
}

const shipped::Options kImage = {
    {"image_size_px", std::vector<double>{101, 81}}, {"pixel_mm", std::vector<double>{0.5}}, {"mirror", "upside_down"}};

Camera read(const std::filesystem::path& path, const shipped::Options& changed = {}) {
  shipped::Options options = changed;
  options.insert(kImage.begin(), kImage.end());
  return read_by<Camera>("read.camera", path, options);
}

// Without angles a point (x, y, z) is seen at 1500 (x, y) / (1000 - z) mm: (10, 5, 100) at (16.667, 8.333) mm. The
// image has its middle at 0, so the centre of its first pixel is at (-25, -20) mm, and the point is at column 83.333
// and row 56.667. Turned upside down, this is row 80 - 56.667.
const Vector2d kSeen((50.0 / 3 + 25) / 0.5, 80 - (25.0 / 3 + 20) / 0.5);

void expect_seen(const std::string& text, const Vector3d& point, const Vector2d& pixel) {
  const TemporaryFolder folder;
  put(folder / "g.xml", text);
  EXPECT_LT((project(read(folder / "g.xml"), point) - pixel).norm(), 1e-9) << text;
}

TEST_F(Rtk, PointsByHand) {
  expect_seen(file("<GantryAngle>0</GantryAngle>"), {10, 5, 100}, kSeen);
  // The gantry turns about y, so the source goes from z to x; the other angles likewise, about x and z.
  expect_seen(file("<GantryAngle>90</GantryAngle>"), {100, 5, -10}, kSeen);
  expect_seen(file("<OutOfPlaneAngle>90</OutOfPlaneAngle>"), {10, -100, 5}, kSeen);
  expect_seen(file("<InPlaneAngle>90</InPlaneAngle>"), {-5, 10, 100}, kSeen);
  expect_seen(file("<Angle>90</Angle>"), {100, 5, -10}, kSeen);
}

// The matrix as RTK's documentation gives it: u = 1500 (x - 3) / 900 + 3 - 2, v = 1500 (y + 4) / 900 - 4 - 1.
TEST_F(Rtk, OffsetsOfSourceAndDetector) {
  const Vector2d mm(1500 * 7.0 / 900 + 1, 1500 * 9.0 / 900 - 5);
  expect_seen(file("<SourceOffsetX>3</SourceOffsetX><SourceOffsetY>-4</SourceOffsetY><ProjectionOffsetX>2"
                   "</ProjectionOffsetX><ProjectionOffsetY>1</ProjectionOffsetY>"),
              {10, 5, 100}, {(mm.x() + 25) / 0.5, 80 - (mm.y() + 20) / 0.5});
}

TEST_F(Rtk, TheOriginOfTheImageAndTheOtherWayToTurnIt) {
  put(folder / "g.xml", file("<GantryAngle>0</GantryAngle>"));
  const Camera moved = read(folder / "g.xml", {{"corner_mm", std::vector<double>{-30, -10}}});
  EXPECT_LT((project(moved, {10, 5, 100}) - Vector2d((50.0 / 3 + 30) / 0.5, 80 - (25.0 / 3 + 10) / 0.5)).norm(), 1e-9);
  const Camera turned = read(folder / "g.xml", {{"mirror", "left_right"}});
  EXPECT_LT((project(turned, {10, 5, 100}) - Vector2d(100 - kSeen.x(), 80 - kSeen.y())).norm(), 1e-9);
  const Camera wide = read(folder / "g.xml", {{"pixel_mm", std::vector<double>{0.25, 0.5}}});
  EXPECT_LT((project(wide, {10, 5, 100}) - Vector2d((50.0 / 3 + 12.5) / 0.25, kSeen.y())).norm(), 1e-9);
}

// A projection without an element has the value of the projection before.
TEST_F(Rtk, ProjectionsByNumber) {
  put(folder / "g.xml", with(file("<SourceOffsetX>3</SourceOffsetX>"), "</RTK",
                             "<Projection><GantryAngle>90</GantryAngle></Projection></RTK"));
  const Camera first = read(folder / "g.xml"), second = read(folder / "g.xml", {{"projection", 1LL}});
  EXPECT_LT((source_position_mm(first) - Vector3d(3, 0, 1000)).norm(), 1e-9);
  EXPECT_LT((source_position_mm(second) - Vector3d(1000, 0, -3)).norm(), 1e-9);
  EXPECT_SAYS(read(folder / "g.xml", {{"projection", 2LL}}),
              "g.xml: has 2 projections, counted from 0; there is no projection 2");
}

TEST_F(Rtk, TheMatrixIsChecked) {
  const std::string good = "<Matrix>\n -1500 0 0 0\n 0 -1500 0 0\n 0 0 1 -1000\n</Matrix>";
  put(folder / "g.xml", file("<GantryAngle>0</GantryAngle>", good));
  EXPECT_LT((project(read(folder / "g.xml"), {10, 5, 100}) - kSeen).norm(), 1e-9);
  put(folder / "g.xml", file("<GantryAngle>0</GantryAngle>", with(good, "0 -1500", "0 -1499")));
  EXPECT_REFUSED(
      read(folder / "g.xml"), "g.xml",
      "g.xml:13: Matrix: row 2, column 2 is -1499.000000, but the angles and distances give -1500.000000; one "
      "of them was changed: write it again with RTK");
  put(folder / "g.xml", file("<GantryAngle>0</GantryAngle>", with(good, "0 -1500", "-1500")));
  EXPECT_REFUSED(read(folder / "g.xml"), "g.xml", "Matrix: expected 12 numbers of at most 1e7, got 11");
}

List<Camera> cameras() {
  List<Camera> all;
  for (const Vector3d& turn : {Vector3d(0, 0, 0), {0.3, -0.5, 0.8}, {kPi / 2, 0, 0}, {-1, 2, 1}}) {
    Camera camera{640, 480, {}, {"camera", "world"}};
    camera.intrinsics << 2500, 0, 300.25, 0, 2000, 251, 0, 0, 1;
    camera.camera_from_world.rotation = rotation_from_vector(turn);
    camera.camera_from_world.translation_mm = {10, -20, 700};
    all.add("view " + std::to_string(all.size()), camera);
  }
  return all;
}

TEST_F(Rtk, WhatIsWrittenIsReadBack) {
  const auto outputs = shipped::call("write.rtk", {{"cameras", shipped::list(cameras(), "view")}},
                                     {{"pixel_mm", std::vector<double>{0.4, 0.5}}});
  writing::write(outputs.at("geometry").as<RtkFile>(), folder / "g.xml");
  for (std::size_t i = 0; i < cameras().size(); ++i) {
    const Camera& camera = cameras()[i];
    const Camera back = read_by<Camera>("read.camera", folder / "g.xml",
                                        {{"projection", (long long)(i)},
                                         {"image_size_px", std::vector<double>{640, 480}},
                                         {"pixel_mm", std::vector<double>{0.4, 0.5}},
                                         {"mirror", "upside_down"}});
    for (const Vector3d& point : {Vector3d(0, 0, 0), {30, -40, 50}, {-60, 20, -10}})
      EXPECT_LT((project(back, point) - project(camera, point)).norm(), 1e-9) << i;
    EXPECT_LT((back.camera_from_world.rotation - camera.camera_from_world.rotation).norm(), 1e-7) << i;
    EXPECT_LT((back.intrinsics - camera.intrinsics).norm(), 1e-8) << i;
  }
}

TEST_F(Rtk, DiagnosesFaults) {
  const std::string good = file("<GantryAngle>0</GantryAngle>");
  std::string bomb = "<!DOCTYPE x [<!ENTITY a \"0000000000\">";
  for (char c = 'b'; c <= 'z'; ++c)
    bomb += std::string("<!ENTITY ") + c + " \"" + std::string("&") + char(c - 1) + ";&" + char(c - 1) + ";&" +
            char(c - 1) + ";&" + char(c - 1) + ";\">";
  expect_faults(
      folder / "g.xml", good,
      {{"", good.substr(0, 200), "g.xml:5: is no well-formed XML ("},
       {"", "no XML\n", "g.xml:1: is no well-formed XML ("},
       {"", "<Scene/>",
        "g.xml:1: expected <RTKThreeDCircularGeometry>, got <Scene>; only this geometry of RTK is read"},
       {"\"3\"", "\"4\"", "g.xml:3: expected version 2 or 3 of RTK's geometry, got '4'; write it again"},
       {" version=\"3\"", "", "g.xml:3: expected version 2 or 3 of RTK's geometry, got ''; write it again"},
       {"", file("<GantryAngle>nan</GantryAngle>"),
        "g.xml:7: GantryAngle: expected a number of at most 1e7, got 'nan'"},
       {"", file("<GantryAngle>1e9</GantryAngle>"),
        "g.xml:7: GantryAngle: expected a number of at most 1e7, got '1e9'"},
       {"", file("<GantryAngle>1 2</GantryAngle>"), "GantryAngle: expected a number of at most 1e7, got '1 2'"},
       {"", file("<GantryAngel>0</GantryAngel>"), "g.xml:7: unknown element <GantryAngel>"},
       {"", file("<RadiusCylindricalDetector>800</RadiusCylindricalDetector>"),
        "g.xml:7: RadiusCylindricalDetector: the detector is curved, but marrow's cameras have flat ones"},
       {"", file("<SourceToDetectorDistance>0</SourceToDetectorDistance>"),
        "g.xml:9: SourceToDetectorDistance is 0 or missing: the rays are parallel, but marrow's cameras have a source"},
       {"", file("<SourceToDetectorDistance>-5</SourceToDetectorDistance>"),
        "SourceToDetectorDistance: expected a positive distance in mm"},
       {"", file("<Projection></Projection>"), "g.xml:7: a <Projection> begins inside another"},
       {"", with(with(good, "<Projection>", ""), "</Projection>", ""),
        "there is no <Projection> in it; write it again"},
       {"",
        bomb + "]><RTKThreeDCircularGeometry version=\"3\"><Projection><GantryAngle>&z;</GantryAngle></Projection>"
               "</RTKThreeDCircularGeometry>",
        "g.xml:1: "}},
      [](const auto& path) { read(path); });
}

TEST_F(Rtk, DiagnosesWhatTheImageLacks) {
  put(folder / "g.xml", file("<GantryAngle>0</GantryAngle>"));
  EXPECT_SAYS(
      read(folder / "g.xml", {{"mirror", "none"}}),
      "g.xml: projection 0: its images are seen from the detector, or have their rows from below; turn them over "
      "by mirror: left_right or upside_down when they are read, and give the same mirror here");
  EXPECT_SAYS(read(folder / "g.xml", {{"image_size_px", std::vector<double>{}}}),
              "g.xml: projection 0: does not say how many pixels the image has; wire the image, or give image_size_px");
  EXPECT_SAYS(read(folder / "g.xml", {{"pixel_mm", std::vector<double>{}}}),
              "g.xml: projection 0: needs the size of a pixel on the detector; give pixel_mm: [width, height]");
  EXPECT_SAYS(read(folder / "g.xml", {{"corner_mm", std::vector<double>{1}}}),
              "g.xml: projection 0: corner_mm: expected [u, v], the place of the first pixel's centre on the detector, "
              "got 1 numbers");
}

TEST_F(Rtk, DiagnosesCamerasThatItCannotHold) {
  const auto refusal = [](const Camera& camera, std::vector<double> pixel_mm) {
    List<Camera> one;
    one.add("a", camera);
    return shipped::refusal("write.rtk", {{"cameras", shipped::list(one, "view")}},
                            {{"pixel_mm", std::move(pixel_mm)}});
  };
  EXPECT_CONTAINS(refusal(cameras()[0], {0.5}),
                  "camera 1: pixel_mm: with these pixels the detector is 1250 mm from the "
                  "source by the width and 1000 mm by the height; give the pixel's true");
  Camera askew = cameras()[0];
  askew.intrinsics(0, 1) = 5;
  EXPECT_CONTAINS(refusal(askew, {0.4, 0.5}),
                  "camera 1: its pixels are askew (the camera matrix has 5 in its first row's "
                  "second place), which RTK's geometry cannot hold");
}

}  // namespace rtk_test
