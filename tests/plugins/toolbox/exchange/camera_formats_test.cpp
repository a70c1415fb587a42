// SPDX-License-Identifier: Apache-2.0
#include <cstdlib>
#include <sstream>

#include "marrow/toolbox/exchange/written_files.hpp"
#include "tests/plugins/toolbox/exchange/values.hpp"

namespace camera_formats_test {

using namespace marrow;
using namespace marrow::test;
using Eigen::Vector3d, Eigen::Vector2d;
using exchange::RtkFile;
using Rtk = InAFolder;
using exchange::PlastimatchFile;
using Plastimatch = InAFolder;

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

TEST_F(Rtk, PointsByHandAndOffsetsOfSourceAndDetector) {
  expect_seen(file("<GantryAngle>0</GantryAngle>"), {10, 5, 100}, kSeen);
  // The gantry turns about y, so the source goes from z to x; the other angles likewise, about x and z.
  expect_seen(file("<GantryAngle>90</GantryAngle>"), {100, 5, -10}, kSeen);
  expect_seen(file("<OutOfPlaneAngle>90</OutOfPlaneAngle>"), {10, -100, 5}, kSeen);
  expect_seen(file("<InPlaneAngle>90</InPlaneAngle>"), {-5, 10, 100}, kSeen);
  expect_seen(file("<Angle>90</Angle>"), {100, 5, -10}, kSeen);
  // The matrix as RTK's documentation gives it: u = 1500 (x - 3) / 900 + 3 - 2, v = 1500 (y + 4) / 900 - 4 - 1.
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
  EXPECT_HAS(refusal(cameras()[0], {0.5}),
             "camera 1: pixel_mm: with these pixels the detector is 1250 mm from the "
             "source by the width and 1000 mm by the height; give the pixel's true");
  Camera askew = cameras()[0];
  askew.intrinsics(0, 1) = 5;
  EXPECT_HAS(refusal(askew, {0.4, 0.5}),
             "camera 1: its pixels are askew (the camera matrix has 5 in its first row's "
             "second place), which RTK's geometry cannot hold");
}

Camera read_sized(const std::filesystem::path& path, std::vector<double> image_size_px = {120, 160}) {
  return read_by<Camera>("read.camera", path, {{"image_size_px", std::move(image_size_px)}});
}

// Written by: plastimatch drr --nrm "1 0 0" --vup "0 0 1" --sad 1000 --sid 1500 -r "120 160" -z "120 240" -c "50 70"
// -o "0 0 0". The source is at x = 1000 mm, the detector at x = -500. Seen from the source with z up, y is to the
// right. A pixel is 1 mm wide and 1.5 mm high.
TEST_F(Plastimatch, PointsOfALateralViewByHand) {
  const Camera camera = read_sized(kData / "plastimatch-lateral.txt");
  EXPECT_EQ(camera.width_px, 120);
  EXPECT_EQ(camera.height_px, 160);
  EXPECT_LT((source_position_mm(camera) - Vector3d(1000, 0, 0)).norm(), 1e-6);
  EXPECT_LT((project(camera, {0, 0, 0}) - Vector2d(50, 70)).norm(), 1e-6);
  const double magnification = 1500.0 / 990;
  const Vector2d expected(50 - 6 * magnification, 70 - 8 * magnification / 1.5);
  EXPECT_LT((project(camera, {10, -6, 8}) - expected).norm(), 1e-5) << "the file has 9 digits";
}

// Written by: plastimatch drr -y 30 -r "100 120" -z "100 150" -o "1 2 3". The isocentre is seen in the middle.
TEST_F(Plastimatch, TheIsocentreOfAnObliqueView) {
  const Camera camera = read_sized(kData / "plastimatch-oblique.txt", {100, 120});
  EXPECT_LT((project(camera, {1, 2, 3}) - Vector2d(49.5, 59.5)).norm(), 1e-5);
  EXPECT_NEAR((source_position_mm(camera) - Vector3d(1, 2, 3)).norm(), 1000, 1e-4);
}

TEST_F(Plastimatch, TheSizeMayComeFromTheImage) {
  Image image;
  image.pixels = cv::Mat(160, 120, CV_8U, cv::Scalar(0));
  const auto outputs = shipped::call("read.camera", {{"image", shipped::item(image)}},
                                     {{"path", (kData / "plastimatch-lateral.txt").string()}});
  EXPECT_EQ(outputs.at("camera").as<Camera>().width_px, 120);
  EXPECT_EQ(outputs.at("camera").as<Camera>().height_px, 160);
}

Camera oblique_camera() {
  Camera camera{640, 480, {}, {"camera", "world"}};
  camera.intrinsics << 2500, 0, 300.25, 0, 2000, 251, 0, 0, 1;
  camera.camera_from_world.rotation = rotation_from_vector({0.3, -0.5, 0.8});
  camera.camera_from_world.translation_mm = {10, -20, 700};
  return camera;
}

TEST_F(Plastimatch, WhatIsWrittenIsReadBack) {
  const Camera camera = oblique_camera();
  const shipped::Options options = {{"pixel_mm", std::vector<double>{0.4, 0.5}}};
  const std::string bytes =
      written_by<PlastimatchFile>("write.plastimatch", "camera", camera, folder / "c.txt", options);
  const Camera back = read_sized(folder / "c.txt", {640, 480});
  EXPECT_EQ(back.camera_from_world.rotation, camera.camera_from_world.rotation);
  EXPECT_EQ(back.camera_from_world.translation_mm, camera.camera_from_world.translation_mm);
  EXPECT_LT((back.intrinsics - camera.intrinsics).cwiseAbs().maxCoeff(), 1e-11);
  std::istringstream lines(bytes);
  std::vector<std::string> line(7);
  for (std::string& text : line) std::getline(lines, text);
  EXPECT_EQ(line[0], "300.25 251") << "the pixel that the central ray meets";
  EXPECT_EQ(line[4], "700") << "source to isocentre";
  EXPECT_EQ(line[5], "1000") << "source to detector: 2500 pixels of 0.4 mm, 2000 of 0.5 mm";
  View view;
  view.camera = camera;
  EXPECT_EQ(written_by<PlastimatchFile>("write.plastimatch", "view", view, folder / "v.txt", options), bytes);
}

/// A portable float map as plastimatch writes it: the first row first.
cv::Mat1f read_pfm(const std::filesystem::path& path) {
  std::istringstream stream(bytes_of(path));
  std::string magic;
  int width = 0, height = 0;
  double scale = 0;
  stream >> magic >> width >> height >> scale;
  stream.get();
  cv::Mat1f image(height, width);
  stream.read(image.ptr<char>(), std::streamsize(image.total() * sizeof(float)));
  return image;
}

// The one test with plastimatch itself: it draws a ball of 8 mm, and the ball's shadow is where marrow's camera
// projects the ball's centre. A pixel is not square, and the isocentre is not the origin.
TEST_F(Plastimatch, ABallThatPlastimatchDrawsIsWhereMarrowProjectsIt) {
  if (std::system("plastimatch --version > /dev/null 2>&1") != 0) GTEST_SKIP() << "not installed here: plastimatch";
  const std::string quiet = " > " + (folder / "log").string() + " 2>&1";
  const std::string ball = (folder / "ball.mha").string();
  ASSERT_EQ(std::system(("plastimatch synth --pattern sphere --output " + ball +
                         " --dim 100 --spacing 0.5 --origin '-24.75 -24.75 -24.75' --radius 8 --center '10 -6 8'"
                         " --background -1000 --foreground 1000" +
                         quiet)
                            .c_str()),
            0);
  const Vector3d centre(10, -6, 8);
  double worst_px = 0;
  for (const char* view : {"--nrm '1 0 0' --vup '0 0 1' -o '0 0 0'", "--nrm '0 -1 0' --vup '0 0 1' -o '3 -5 7'",
                           "--nrm '0.6 0 0.8' --vup '0 1 0' -o '5 5 5'", "--nrm '2 3 -4' --vup '1 0 0' -o '-4 2 9'"}) {
    ASSERT_EQ(std::system(("plastimatch drr " + std::string(view) +
                           " --sad 1000 --sid 1500 -r '240 200' -z '120 120'"
                           " -c '119.5 99.5' -t pfm -O " +
                           (folder / "drr").string() + " " + ball + quiet)
                              .c_str()),
              0);
    const cv::Mat1f image = read_pfm(folder / "drr0000.pfm");
    ASSERT_EQ(image.cols, 240);
    ASSERT_EQ(image.rows, 200);
    double weight = 0;
    Vector2d shadow = Vector2d::Zero();
    for (int v = 0; v < image.rows; ++v)
      for (int u = 0; u < image.cols; ++u) {
        weight += image(v, u);
        shadow += double(image(v, u)) * Vector2d(u, v);
      }
    ASSERT_GT(weight, 0) << view;
    const double off_px = (project(read_sized(folder / "drr0000.txt", {240, 200}), centre) - shadow / weight).norm();
    EXPECT_LT(off_px, 0.5) << view;
    worst_px = std::max(worst_px, off_px);
  }
  std::printf("the ball's shadow is at most %.3f px from where marrow projects its centre\n", worst_px);
}

TEST_F(Plastimatch, DiagnosesFaults) {
  const std::string good = bytes_of(kData / "plastimatch-lateral.txt");
  expect_faults(folder / "c.txt", good,
                {{"", good.substr(0, 200), "c.txt:4: expected a row of the projection matrix, 4 numbers, got '"},
                 {"", good.substr(0, good.find("   -1.0000")),
                  "c.txt:7: expected the direction of the central ray, 3 numbers, got ''"},
                 {"Extrinsic", "Exterior", "c.txt:8: expected 'Extrinsic', got 'Exterior'; plastimatch drr writes"},
                 {"1.00000000e+03", "nan", "c.txt:5: expected the distance of the isocentre from the source, 1 number"},
                 {"6.66666667e-01", "6.66666667e+99",
                  "c.txt: row 2 of its matrix is not that of Intrinsic times Extrinsic; one of them was changed: write "
                  "it again"}},
                [](const auto& path) { read_sized(path); });
  put(folder / "c.txt", good);
  EXPECT_REFUSED(read_sized(folder / "c.txt", {}), "c.txt",
                 "does not say how many pixels the image has; wire the image, or give image_size_px: [width, height]");
  EXPECT_REFUSED(read_sized(folder / "c.txt", {120}), "c.txt",
                 "image_size_px: expected [width, height], got 1 numbers");
  EXPECT_REFUSED(read_sized(folder / "c.txt", {0, 160}), "c.txt",
                 "image_size_px: expected 1 to 65536 pixels each way, got 0");
  EXPECT_REFUSED(read_sized(folder / "c.txt", {120, 1e9}), "c.txt",
                 "image_size_px: expected 1 to 65536 pixels each way, got 1000000");
  const auto refusal = [&](const shipped::Options& options) {
    shipped::Options all = options;
    all["path"] = (folder / "c.txt").string();
    return shipped::refusal("read.camera", {}, all);
  };
  EXPECT_HAS(refusal({{"mirror", "left_right"}}), "mirror is not for this format of cameras; leave it out");
  EXPECT_HAS(refusal({{"projection", 1LL}}), "projection is not for this format of cameras");
  EXPECT_HAS(refusal({{"pixel_mm", std::vector<double>{1}}}), "pixel_mm is not for this format");
  EXPECT_HAS(shipped::refusal("write.plastimatch", {{"camera", shipped::item(oblique_camera())}},
                              {{"pixel_mm", std::vector<double>{-1}}}),
             "pixel_mm: expected a size in mm between 1e-6 and 1000, got -1");
  EXPECT_HAS(shipped::refusal("write.plastimatch", {{"camera", shipped::item(oblique_camera())}},
                              {{"pixel_mm", std::vector<double>{1, 1, 1}}}),
             "pixel_mm: expected [width, height], or one number for square pixels, got 3");
}

// A format would ignore an option that it does not need.
TEST_F(Plastimatch, DiagnosesOptionsThatAFormatDoesNotNeed) {
  put(folder / "c.yaml", "marrow-camera: 1\n");
  put(folder / "c.xml", "<a/>");
  put(folder / "c.h5", "a");
  const auto expect = [&](const std::string& name, const shipped::Options::value_type& option,
                          const std::string& said) {
    shipped::Options options{option};
    options["path"] = (folder / name).string();
    EXPECT_EQ(shipped::refusal("read.camera", {}, options),
              (folder / name).string() + ": " + said + " is not for this format of cameras; leave it out");
  };
  expect("c.yaml", {"image_size_px", std::vector<double>{3, 4}}, "image_size_px");
  expect("c.h5", {"image_size_px", std::vector<double>{3, 4}}, "image_size_px");
  expect("c.h5", {"pixel_mm", std::vector<double>{1}}, "pixel_mm");
  expect("c.h5", {"corner_mm", std::vector<double>{0, 0}}, "corner_mm");
  expect("c.yaml", {"mirror", "upside_down"}, "mirror");
  Image image;
  image.pixels = cv::Mat(4, 4, CV_8U, cv::Scalar(0));
  EXPECT_HAS(shipped::refusal("read.camera", {{"image", shipped::item(image)}},
                              {{"path", (kData / "xreg-by-h5py.h5").string()}}),
             "this camera is of images of 200 x 160 pixels, but the image has 4 x 4");
}

TEST_F(Plastimatch, DiagnosesWhatIsNoCameraOrNothingToWrite) {
  const shipped::Options options{{"pixel_mm", std::vector<double>{1}}};
  EXPECT_EQ(shipped::refusal("write.plastimatch", {}, options),
            "the node that is wired to 'camera' or 'view' gave none");
  for (const char* node : {"write.rtk", "write.xreg"})
    EXPECT_EQ(shipped::refusal(node, {}, options), "the node that is wired to 'cameras' or 'views' gave none");
  // Here the matrix agrees with its factors.
  const auto text = [](const char* matrix, const char* extrinsic, const char* intrinsic) {
    return "0 0\n" + std::string(matrix) + "1000\n1500\n0 0 1\nExtrinsic\n" + extrinsic + "0 0 0 1\nIntrinsic\n" +
           intrinsic;
  };
  const char* const identity = "1 0 0 0\n0 1 0 0\n0 0 1 0\n";
  const auto expect = [&](const std::string& bytes, const std::string& said) {
    put(folder / "c.txt", bytes);
    EXPECT_REFUSED(read_sized(folder / "c.txt"), "c.txt", said);
  };
  expect(text("2 0 0 0\n0 1 0 0\n0 0 1 0\n", "2 0 0 0\n0 1 0 0\n0 0 1 0\n", identity),
         "its extrinsic matrix is no rotation and translation; it is damaged: write it again");
  expect(text("1 0 0 0\n0 1 0 0\n0 0 -1 0\n", identity, "1 0 0 0\n0 1 0 0\n0 0 -1 0\n"),
         "its intrinsic matrix is not that of a camera that looks from the source: expected 1/pixel, 1/pixel");
}

}  // namespace camera_formats_test
