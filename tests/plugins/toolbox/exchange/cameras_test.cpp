// SPDX-License-Identifier: Apache-2.0
// Cameras that were calibrated in another unit than mm. A camera's matrix counts pixels, so only its place depends on
// the unit: 10 times that of the file for cm.
// Views whose cameras are in files of other programs: as read.view, read.views and read.case take them.
#include "marrow/toolbox/files/samples_out.hpp"
#include "tests/plugins/toolbox/exchange/values.hpp"

namespace cameras_test {

using namespace marrow;
using namespace marrow::test;
using Eigen::Vector3d;

/// A source that is 88 of the file's units from the origin: sqrt(2^2 + 8.9^2 + 87.53^2) = 88.004.
const std::string kXmalab =
    "image size\n64,48\n\ncamera matrix\n300,0,32\n0,300,24\n0,0,1\n\nrotation\n0,-1,0\n1,0,0\n0,0,1\n\n"
    "translation\n2\n-8.9\n87.53\n\n";
const std::string kDoubt =
    "/cm.txt: the X-ray source is 88 mm from the world's origin, where devices have 200 to 5000; looks like cm: give "
    "scale: 10\n";

/// RTK's geometry with its lengths in mm, or in cm.
std::string rtk(bool in_cm) {
  const std::string in_mm =
      rtk_geometry("<Projection><GantryAngle>30</GantryAngle><ProjectionOffsetX>20</ProjectionOffsetX></Projection>\n");
  return in_cm ? with(with(with(in_mm, "1000", "100"), "1500", "150"), ">20<", ">2<") : in_mm;
}

class CameraScale : public InAFolder {
 protected:
  CameraScale() {
    put(folder / "cm.txt", kXmalab);
    const std::string pixels(64 * 48, '\1');
    put(folder / "a.png", files::png_of(64, 48, 1, files::Sample::u8, pixels.data()));
  }
  /// What the node gives, and in `said` what it says.
  shipped::Outputs call(const std::string& node, const shipped::Options& options) {
    shipped::Outputs outputs;
    said.clear();
    for (const std::string& line :
         said_by([&](const Context& context) { outputs = shipped::call(node, {}, options, context); }))
      said += without_folder(line, folder.path()) + "\n";
    return outputs;
  }
  std::string at(const std::string& name) const { return (folder / name).string(); }
  std::string said;
  const Vector3d kInMm{20, -89, 875.3};
};

TEST_F(CameraScale, OfOneCamera) {
  const auto as_mm = call("read.camera", {{"path", at("cm.txt")}}).at("camera").as<Camera>();
  EXPECT_EQ(as_mm.camera_from_world.translation_mm, Vector3d(2, -8.9, 87.53));
  EXPECT_EQ(said, kDoubt);
  const auto scaled = call("read.camera", {{"path", at("cm.txt")}, {"scale", 10.0}}).at("camera").as<Camera>();
  EXPECT_LT((scaled.camera_from_world.translation_mm - kInMm).norm(), 1e-12);
  EXPECT_EQ(scaled.intrinsics, as_mm.intrinsics);
  EXPECT_EQ(said, "");
}

TEST_F(CameraScale, NamesTheUnitThatItLooksLike) {
  const auto doubt = [&](double scale) {
    call("read.camera", {{"path", at("cm.txt")}, {"scale", scale}});
    return said;
  };
  EXPECT_HAS(doubt(0.01),
             "is 0.88 mm from the world's origin, where devices have 200 to 5000; looks like m: give "
             "scale: 10\n");
  EXPECT_HAS(doubt(0.2),
             "is 17.6 mm from the world's origin, where devices have 200 to 5000; looks like inches: give "
             "scale: 5.08\n");
  EXPECT_HAS(doubt(1e4),
             "is 8.8e+05 mm from the world's origin, where devices have 200 to 5000; looks like "
             "micrometres: give scale: 10\n");
  EXPECT_EQ(doubt(2.3), "");    // 202 mm
  EXPECT_EQ(doubt(56.8), "");   // 4999 mm
  EXPECT_NE(doubt(2.27), "");   // 199.8 mm
  EXPECT_NE(doubt(56.83), "");  // 5001 mm
  // Where a camera is the world itself, its distance says nothing.
  put(folder / "cm.txt", with(kXmalab, "2\n-8.9\n87.53", "0\n0\n0"));
  EXPECT_EQ(doubt(1), "");
}

TEST_F(CameraScale, OfViews) {
  const shipped::Options one = {{"name", "ap"}, {"image", at("a.png")}, {"camera", at("cm.txt")}};
  call("read.view", one);
  EXPECT_EQ(said, "view 'ap': " + kDoubt);
  shipped::Options scaled = one;
  scaled["scale"] = 10.0;
  const auto view = call("read.view", scaled).at("view").as<View>();
  EXPECT_LT((view.camera.camera_from_world.translation_mm - kInMm).norm(), 1e-12);
  EXPECT_EQ(said, "");
  const shipped::Options all = {{"names", std::vector<std::string>{"ap"}},
                                {"images", std::vector<std::string>{at("a.png")}},
                                {"cameras", std::vector<std::string>{at("cm.txt")}},
                                {"scale", 10.0}};
  const auto views = call("read.views", all).at("views").as_list<View>();
  EXPECT_LT((views[0].camera.camera_from_world.translation_mm - kInMm).norm(), 1e-12);
  EXPECT_EQ(said, "");
  call("read.sequence", {{"names", std::vector<std::string>{"ap"}},
                         {"images", std::vector<std::string>{at("a.png")}},
                         {"cameras", std::vector<std::string>{at("cm.txt")}}});
  EXPECT_EQ(said, "view 'ap': " + kDoubt);
}

TEST_F(CameraScale, OfACase) {
  put(folder / "case/cm.txt", kXmalab);
  put(folder / "case/a.png", bytes_of(folder / "a.png"));
  put(folder / "case/ct.mha",
      "ObjectType = Image\nNDims = 3\nDimSize = 2 2 2\nElementType = MET_SHORT\nElementSpacing = 1 1 1\nBinaryData = "
      "True\n"
      "ElementDataFile = LOCAL\n" +
          std::string(16, '\0'));
  const auto text = [](const std::string& camera) {
    return "marrow-case: 1\nct: ct.mha\nviews:\n  - {name: ap, image: a.png, camera: " + camera +
           "}\nfragments:\n  distal: {seeds: [[0.5, 0.5, 0.5]]}\n";
  };
  put(folder / "case/case.yaml", text("cm.txt"));
  call("read.case", {{"path", at("case")}});
  EXPECT_EQ(said, "/case" + kDoubt);
  put(folder / "case/case.yaml", text("{file: cm.txt, scale: 10}"));
  const auto views = call("read.case", {{"path", at("case")}}).at("views").as_list<View>();
  EXPECT_LT((views[0].camera.camera_from_world.translation_mm - kInMm).norm(), 1e-12);
  EXPECT_EQ(said, "");
  put(folder / "case/case.yaml", text("{file: cm.txt, scale: 0}"));
  EXPECT_HAS(shipped::refusal("read.case", {}, {{"path", at("case")}}),
             "scale: expected a factor of at least 1e-6, such as 10 for cm");
}

TEST_F(CameraScale, OfAGeometryWhoseOptionsAreInMm) {
  put(folder / "mm.xml", rtk(false));
  put(folder / "cm.xml", rtk(true));
  shipped::Options options = {{"names", std::vector<std::string>{"ap"}},
                              {"image_size_px", std::vector<double>{64, 48}},
                              {"pixel_mm", std::vector<double>{0.5, 0.4}},
                              {"corner_mm", std::vector<double>{-15, -10}},
                              {"mirror", "upside_down"}};
  options["path"] = at("mm.xml");
  const auto in_mm = call("read.cameras", options).at("cameras").as_list<Camera>()[0];
  options["path"] = at("cm.xml");
  call("read.cameras", options);
  EXPECT_EQ(said,
            "view 'ap': /cm.xml: the X-ray source is 100 mm from the world's origin, where devices have 200 to 5000; "
            "looks like cm: give scale: 10\n");
  options["scale"] = 10.0;
  const auto scaled = call("read.cameras", options).at("cameras").as_list<Camera>()[0];
  EXPECT_LT((scaled.intrinsics - in_mm.intrinsics).norm(), 1e-9);
  EXPECT_LT((scaled.camera_from_world.translation_mm - in_mm.camera_from_world.translation_mm).norm(), 1e-9);
  EXPECT_EQ(said, "");
}

TEST_F(CameraScale, IsRefusedForCamerasInMm) {
  put(folder / "own.yaml",
      "marrow-camera: 1\nwidth_px: 64\nheight_px: 48\nintrinsics: [[300, 0, 32], [0, 300, 24], [0, 0, 1]]\n"
      "camera_from_world:\n  target: camera\n  source: world\n  rotation: [[1, 0, 0], [0, 1, 0], [0, 0, 1]]\n"
      "  translation_mm: [1, 2, 90]\n");
  EXPECT_EQ(
      without_folder(shipped::refusal("read.camera", {}, {{"path", at("own.yaml")}, {"scale", 10.0}}), folder.path()),
      "/own.yaml: scale is not for marrow's cameras, whose lengths are in mm; leave it out");
  const Camera any{64, 48, Vector3d(300, 300, 1).asDiagonal(), {"camera", "world"}};
  EXPECT_EQ(
      shipped::refusal("read.view", {{"camera", shipped::item(any)}},
                       {{"name", "ap"}, {"image", at("a.png")}, {"scale", 10.0}}),
      "view 'ap': its camera is wired; projection, pixel_mm, corner_mm and scale are for a camera file: leave them "
      "out");
}

const std::filesystem::path kXreg = kData / "xreg-by-h5py.h5";  // three projections of 200 x 160 pixels

/// The gantry at 0 and at 90 degrees.
const std::string kRtk = rtk_geometry(
    "  <Projection><GantryAngle>0</GantryAngle></Projection>\n"
    "  <Projection><GantryAngle>90</GantryAngle></Projection>\n");

/// An image whose first pixel only is 1.
void put_image(const std::filesystem::path& path, int width_px, int height_px) {
  std::string pixels(std::size_t(width_px) * std::size_t(height_px), '\0');
  pixels[0] = 1;
  put(path, files::png_of(width_px, height_px, 1, files::Sample::u8, pixels.data()));
}

class ViewCamera : public InAFolder {
 protected:
  ViewCamera() { put(folder / "g.xml", kRtk); }
  shipped::Options with_image(const std::filesystem::path& camera, int width_px, int height_px,
                              shipped::Options options = {}) {
    put_image(folder / "a.png", width_px, height_px);
    options["image"] = (folder / "a.png").string();
    options["camera"] = camera.string();
    return options;
  }
  static View view(const shipped::Options& options) {
    return shipped::call("read.view", {}, options).at("view").as<View>();
  }
  static Camera camera(const std::filesystem::path& path, const shipped::Options& options) {
    return read_by<Camera>("read.camera", path, options);
  }
  static void expect_same(const Camera& a, const Camera& b) { EXPECT_EQ(hash_of(a), hash_of(b)); }
  const shipped::Options kRtkImage = {
      {"projection", 1LL}, {"pixel_mm", std::vector<double>{0.5}}, {"mirror", "upside_down"}};
};

TEST_F(ViewCamera, ImageAndCameraAreTurnedOverTogether) {
  const View read = view(with_image(kXreg, 200, 160, {{"projection", 2LL}, {"mirror", "left_right"}}));
  EXPECT_EQ(read.image.pixels.at<std::uint8_t>(0, 199), 1);
  expect_same(read.camera, camera(kXreg, {{"projection", 2LL}, {"mirror", "left_right"}}));
}

TEST_F(ViewCamera, TheImageSaysItsSize) {
  expect_same(view(with_image(kData / "plastimatch-lateral.txt", 120, 160)).camera,
              camera(kData / "plastimatch-lateral.txt", {{"image_size_px", std::vector<double>{120, 160}}}));
  shipped::Options sized = kRtkImage;
  sized["image_size_px"] = std::vector<double>{101, 81};
  const View read = view(with_image(folder / "g.xml", 101, 81, kRtkImage));
  EXPECT_EQ(read.image.pixels.at<std::uint8_t>(80, 0), 1);
  expect_same(read.camera, camera(folder / "g.xml", sized));
}

TEST_F(ViewCamera, EachViewHasItsProjection) {
  put_image(folder / "a.png", 101, 81);
  const std::string image = (folder / "a.png").string(), geometry = (folder / "g.xml").string();
  const shipped::Options options = {{"names", std::vector<std::string>{"a", "b"}},
                                    {"images", std::vector<std::string>{image, image}},
                                    {"cameras", std::vector<std::string>{geometry, geometry}},
                                    {"projections", std::vector<double>{1, 0}},
                                    {"pixel_mm", std::vector<double>{0.5}},
                                    {"mirror", "upside_down"}};
  const auto views = shipped::call("read.views", {}, options).at("views").as_list<View>();
  shipped::Options sized = kRtkImage;
  sized["image_size_px"] = std::vector<double>{101, 81};
  expect_same(views[0].camera, camera(folder / "g.xml", sized));
  sized["projection"] = 0LL;
  expect_same(views[1].camera, camera(folder / "g.xml", sized));
  shipped::Options half = options;
  half["projections"] = std::vector<double>{1, 0.5};
  EXPECT_HAS(shipped::refusal("read.views", {}, half), "view 'b': projections: expected whole numbers from 0, got 0.5");
}

TEST_F(ViewCamera, WhatIsMissingOrTooMuchIsSaid) {
  const auto refusal = [&](const std::filesystem::path& path, int width_px, int height_px,
                           const shipped::Options& options = {}) {
    return shipped::refusal("read.view", {}, with_image(path, width_px, height_px, options));
  };
  EXPECT_EQ(refusal(kXreg, 200, 160), kXreg.string() +
                                          ": has 3 projections; say by its number, counted from 0, "
                                          "which one is meant (projection)");
  EXPECT_HAS(refusal(folder / "g.xml", 101, 81), "g.xml: has 2 projections; say by its number");
  EXPECT_HAS(refusal(kXreg, 200, 160, {{"projection", 1LL}}), "its images are seen from the detector");
  EXPECT_HAS(refusal(kXreg, 20, 160, {{"projection", 0LL}}),
             "the image has 20 x 160 pixels, but its camera is for 200 x 160");
  EXPECT_HAS(refusal(kXreg, 200, 160, {{"projection", 0LL}, {"pixel_mm", std::vector<double>{1}}}),
             "pixel_mm is not for this format of cameras; leave it out");
  EXPECT_HAS(refusal(folder / "g.xml", 101, 81, {{"projection", 0LL}, {"mirror", "upside_down"}}),
             "needs the size of a pixel on the detector; give pixel_mm");
  put(folder / "c.yaml", "marrow-camera: 1\n");
  EXPECT_HAS(refusal(folder / "c.yaml", 4, 4, {{"projection", 0LL}}), "projection is not for this format");
  shipped::Options wired = with_image("", 4, 4, {{"projection", 0LL}, {"name", "ap"}});
  wired.erase("camera");
  Camera any{4, 4, Vector3d(10, 10, 1).asDiagonal(), {"camera", "world"}};
  EXPECT_EQ(
      shipped::refusal("read.view", {{"camera", shipped::item(any)}}, wired),
      "view 'ap': its camera is wired; projection, pixel_mm, corner_mm and scale are for a camera file: leave them "
      "out");
}

/// A case with one view, whose camera is given by this text.
class CaseCamera : public ViewCamera {
 protected:
  CaseCamera() {
    put(folder / "ct.mha",
        "ObjectType = Image\nNDims = 3\nBinaryData = True\nBinaryDataByteOrderMSB = False\nCompressedData = False\n"
        "TransformMatrix = 1 0 0 0 1 0 0 0 1\nOffset = 0 0 0\nElementSpacing = 1 1 1\nDimSize = 3 3 3\n"
        "ElementType = MET_SHORT\nElementDataFile = LOCAL\n" +
            std::string(54, '\0'));
    put(folder / "x.h5", bytes_of(kXreg));
    put(folder / "p.txt", bytes_of(kData / "plastimatch-lateral.txt"));
  }
  void put_case(const std::string& camera, int width_px, int height_px) {
    put_image(folder / "a.png", width_px, height_px);
    put(folder / "case.yaml", "marrow-case: 1\nct: ct.mha\nviews:\n  - name: ap\n    image: a.png\n    camera: " +
                                  camera + "\nfragments:\n  distal: {seeds: [[1, 1, 1]]}\n");
  }
  View view_of_case(const std::string& camera, int width_px, int height_px) {
    put_case(camera, width_px, height_px);
    return case_at(folder.path()).views[0];
  }
  void expect_said(const std::string& camera, const std::string& expected) {
    put_case(camera, 200, 160);
    const std::string said = message_of([&] { case_at(folder.path()); });
    EXPECT_HAS(said, expected) << "it said: " << said;
  }
};

TEST_F(CaseCamera, FilesOfOtherPrograms) {
  const View read = view_of_case("{file: x.h5, projection: 1, mirror: left_right}", 200, 160);
  EXPECT_EQ(read.image.pixels.at<std::uint8_t>(0, 0), 1) << "the image of a case is turned over already";
  expect_same(read.camera, camera(kXreg, {{"projection", 1LL}, {"mirror", "left_right"}}));
  expect_same(view_of_case("p.txt", 120, 160).camera,
              camera(kData / "plastimatch-lateral.txt", {{"image_size_px", std::vector<double>{120, 160}}}));
  shipped::Options sized = kRtkImage;
  sized["image_size_px"] = std::vector<double>{101, 81};
  sized["corner_mm"] = std::vector<double>{-25, -19};
  expect_same(view_of_case("{file: g.xml, projection: 1, pixel_mm: [0.5, 0.5], corner_mm: [-25, -19], mirror: "
                           "upside_down}",
                           101, 81)
                  .camera,
              camera(folder / "g.xml", sized));
}

TEST_F(CaseCamera, WhatIsWrongIsSaidWithItsLine) {
  expect_said("x.h5", "case.yaml:6:13: a view: camera: ");
  expect_said("x.h5", "x.h5: has 3 projections; say by its number, counted from 0, which one is meant (projection)");
  expect_said("{file: x.h5, projection: 5}", "there is no projection 5");
  expect_said("{file: x.h5, projection: -1}", "projection: expected a whole number from 0");
  expect_said("{file: x.h5, projection: 1, mirror: left}",
              "mirror: expected none, left_right or upside_down, got 'left'");
  expect_said("{file: x.h5, projection: 0, pixel_mm: [1, 1]}", "pixel_mm is not for this format of cameras");
  expect_said("{file: g.xml, projection: 0, pixel_mm: [1], mirror: upside_down}", "pixel_mm");
  expect_said("{file: none.h5, projection: 0}", "file: there is no 'none.h5' in the case's folder");
  expect_said("{file: ../x.h5, projection: 0}", "file: '../x.h5' lies outside the case's folder");
  expect_said("{file: x.h5, frame: 0}", "frame");
}

}  // namespace cameras_test
