// SPDX-License-Identifier: Apache-2.0
// Views whose cameras are in files of other programs: as read.view, read.views and read.case take them.
#include "marrow/toolbox/files/samples_out.hpp"
#include "tests/plugins/toolbox/exchange/values.hpp"

namespace view_camera_test {

using namespace marrow;
using namespace marrow::test;
using Eigen::Vector3d;

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
  EXPECT_CONTAINS(shipped::refusal("read.views", {}, half),
                  "view 'b': projections: expected whole numbers from 0, got 0.5");
}

TEST_F(ViewCamera, WhatIsMissingOrTooMuchIsSaid) {
  const auto refusal = [&](const std::filesystem::path& path, int width_px, int height_px,
                           const shipped::Options& options = {}) {
    return shipped::refusal("read.view", {}, with_image(path, width_px, height_px, options));
  };
  EXPECT_EQ(refusal(kXreg, 200, 160), kXreg.string() +
                                          ": has 3 projections; say by its number, counted from 0, "
                                          "which one is meant (projection)");
  EXPECT_CONTAINS(refusal(folder / "g.xml", 101, 81), "g.xml: has 2 projections; say by its number");
  EXPECT_CONTAINS(refusal(kXreg, 200, 160, {{"projection", 1LL}}), "its images are seen from the detector");
  EXPECT_CONTAINS(refusal(kXreg, 20, 160, {{"projection", 0LL}}),
                  "the image has 20 x 160 pixels, but its camera is for 200 x 160");
  EXPECT_CONTAINS(refusal(kXreg, 200, 160, {{"projection", 0LL}, {"pixel_mm", std::vector<double>{1}}}),
                  "pixel_mm is not for this format of cameras; leave it out");
  EXPECT_CONTAINS(refusal(folder / "g.xml", 101, 81, {{"projection", 0LL}, {"mirror", "upside_down"}}),
                  "needs the size of a pixel on the detector; give pixel_mm");
  put(folder / "c.yaml", "marrow-camera: 1\n");
  EXPECT_CONTAINS(refusal(folder / "c.yaml", 4, 4, {{"projection", 0LL}}), "projection is not for this format");
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
    EXPECT_CONTAINS(said, expected) << "it said: " << said;
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

}  // namespace view_camera_test
