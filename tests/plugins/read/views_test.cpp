// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <cmath>
#include <stdexcept>

#include "shipped.hpp"
#include "tests/plugins/read/files.hpp"
#include "tests/plugins/read/itk_files.hpp"

namespace views_test {

using marrow::test::ItkGrid;
using marrow::test::put;
using marrow::test::TemporaryFolder;
using marrow::test::write_itk;

std::vector<std::string> texts(const std::vector<std::filesystem::path>& paths) { return {paths.begin(), paths.end()}; }

class ReadViews : public testing::Test {
 protected:
  ReadViews() {
    for (const char* name : {"a.png", "b.png"})
      write_itk(folder / name, ItkGrid<std::uint8_t>{.size = {6, 4}, .samples = std::vector<std::uint8_t>(24, 9)});
    for (const char* name : {"a.txt", "b.txt"})
      put(folder / name,
          "image size\n6,4\n\ncamera "
          "matrix\n10,0,3\n0,10,2\n0,0,1\n\nrotation\n1,0,0\n0,1,0\n0,0,1\n\ntranslation\n0\n0\n600\n");
    options["names"] = std::vector<std::string>{"one", "two"};
    options["images"] = texts({folder / "a.png", folder / "b.png"});
    options["cameras"] = texts({folder / "a.txt", folder / "b.txt"});
  }
  marrow::List<marrow::View> views(const shipped::Inputs& inputs = {}) {
    return shipped::call("read.views", inputs, options).at("views").as_list<marrow::View>();
  }
  TemporaryFolder folder;
  shipped::Options options;
};

TEST_F(ReadViews, AllImagesAreTurnedOver) {
  ItkGrid<std::uint8_t> pixels{.size = {6, 4}};
  for (std::uint8_t i = 0; i < 24; ++i) pixels.samples.push_back(i);
  write_itk(folder / "b.png", pixels);
  options["mirror"] = "left_right";
  EXPECT_EQ(views()[1].image.pixels.at<std::uint8_t>(1, 6 - 1 - 2), 6 + 2);
}

TEST_F(ReadViews, AViewWithoutAnImageIsLeftOut) {
  options["images"] = texts({folder / "a.png", ""});
  options["cameras"] = texts({folder / "a.txt", ""});
  EXPECT_EQ(views().names(), std::vector<std::string>{"one"});
  options["images"] = texts({"", ""});
  EXPECT_EQ(shipped::refusal("read.views", {}, options),
            "all images are empty, so there is no view; give at least one image");
  options["images"] = texts({folder / "a.png", folder / "b.png"});
  EXPECT_EQ(shipped::refusal("read.views", {}, options), "view 'two': its camera is not given");
}

TEST_F(ReadViews, ImagesWithTheirCameras) {
  put(folder / "b.txt", marrow::test::with(marrow::test::bytes_of(folder / "b.txt"), "600", "700"));
  const auto value = views();
  EXPECT_EQ(value.names(), (std::vector<std::string>{"one", "two"}));
  EXPECT_EQ(value[1].name, "two");
  EXPECT_EQ(value[0].camera.camera_from_world.translation_mm.z(), 600);
  EXPECT_EQ(value[1].camera.camera_from_world.translation_mm.z(), 700);
}

TEST_F(ReadViews, CamerasAsValuesAreFoundByName) {
  marrow::List<marrow::Camera> cameras;
  marrow::Camera camera{6, 4, Eigen::Vector3d(10, 10, 1).asDiagonal(), {"camera", "world"}};
  camera.camera_from_world.translation_mm.z() = 2;
  cameras.add("two", camera);
  camera.camera_from_world.translation_mm.z() = 1;
  cameras.add("one", camera);
  options.erase("cameras");
  const shipped::Inputs wired{{"camera", shipped::list(cameras, "view")}};
  EXPECT_EQ(views(wired)[0].camera.camera_from_world.translation_mm.z(), 1);
  options["names"] = std::vector<std::string>{"one", "three"};
  EXPECT_SAYS(views(wired), "view 'three' has no camera of that name; there are 'two', 'one'");
}

TEST_F(ReadViews, DiagnosesFaults) {
  write_itk(folder / "b.png", ItkGrid<std::uint8_t>{.size = {6, 5}, .samples = std::vector<std::uint8_t>(30, 9)});
  EXPECT_SAYS(views(), "view 'two': the image has 6 x 5 pixels, but its camera is for 6 x 4");
}

TEST_F(ReadViews, DeclaresAnImageAndACameraForEachName) {
  EXPECT_TRUE(shipped::declares("read.views", marrow::at_least_one({"names"})));
  EXPECT_TRUE(shipped::declares("read.views", marrow::distinct("names")));
  EXPECT_TRUE(shipped::declares("read.views", marrow::same_length({"names", "images"})));
  EXPECT_TRUE(shipped::declares("read.views", marrow::exactly_one({"in.camera", "cameras"})));
  EXPECT_TRUE(shipped::declares("read.views", marrow::as_many_or_none("cameras", "names")));
  options["cameras"] = texts({folder / "a.txt"});
  EXPECT_THROW(views(), std::out_of_range) << "nothing is read past the end of a list";
}

TEST(ReadImages, DeclaresANameForEachOrNone) {
  EXPECT_TRUE(shipped::declares("read.images", marrow::as_many_or_none("names", "paths")));
}

TEST_F(ReadViews, RealWristPairs) {
  MARROW_NEED_DATA(data, "wrist");
  options["images"] =
      texts({data / "images/xr_rad_uln_cam01_UND.0002.tif", data / "images/xr_rad_uln_cam02_UND.0002.tif"});
  options["cameras"] = texts({data / "cameras/xr_calib_wrist_cam01.txt", data / "cameras/xr_calib_wrist_cam02.txt"});
  const auto value = views();
  EXPECT_EQ(value[0].image.width(), 1760);
  const double angle = std::acos(
      value[0].camera.camera_from_world.rotation.row(2).dot(value[1].camera.camera_from_world.rotation.row(2)));
  EXPECT_NEAR(marrow::degrees(angle), 110, 3) << "the cameras stand 110 degrees apart";
}

}  // namespace views_test
