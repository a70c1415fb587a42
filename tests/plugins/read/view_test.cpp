// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include "shipped.hpp"
#include "tests/plugins/read/files.hpp"
#include "tests/plugins/read/itk_files.hpp"
#include "tests/plugins/read/reading.hpp"

namespace view_test {

using marrow::test::view_from;

TEST(ReadView, TakesItsCameraFromAFileOrAValue) {
  const marrow::test::TemporaryFolder folder;
  const marrow::test::ItkGrid<std::uint8_t> pixels{.size = {6, 4}, .samples = std::vector<std::uint8_t>(24, 9)};
  write_itk(folder / "a.png", pixels);
  marrow::test::put(folder / "a.txt",
                    "image size\n6,4\n\ncamera matrix\n10,0,3\n0,10,2\n0,0,1\n\nrotation\n1,0,0\n0,1,0\n0,0,1\n\n"
                    "translation\n0\n0\n600\n");
  const marrow::View from_file = view_from(nullptr, {"frontal", folder / "a.png", folder / "a.txt"});
  EXPECT_EQ(from_file.name, "frontal");
  EXPECT_EQ(from_file.camera.width_px, 6);
  marrow::Camera camera = from_file.camera;
  camera.camera_from_world.translation_mm.z() = 700;
  EXPECT_EQ(view_from(&camera, {"frontal", folder / "a.png"}).camera.camera_from_world.translation_mm.z(), 700);
  EXPECT_TRUE(shipped::declares("read.view", marrow::exactly_one({"in.camera", "camera"})));
  camera.width_px = 7;
  EXPECT_SAYS(view_from(&camera, {"frontal", folder / "a.png"}),
              "view 'frontal': the image has 6 x 4 pixels, but its camera is for 7 x 4");
}

// The camera is that of the image that was turned over, so it stays as it is.
TEST(ReadView, TheImageIsTurnedOverAndItsCameraStays) {
  const marrow::test::TemporaryFolder folder;
  marrow::test::ItkGrid<std::uint8_t> pixels{.size = {6, 4}};
  for (std::uint8_t i = 0; i < 24; ++i) pixels.samples.push_back(i);
  write_itk(folder / "a.png", pixels);
  marrow::Camera camera{6, 4, Eigen::Matrix3d::Identity(), {"camera", "world"}};
  const marrow::View view = shipped::call("read.view", {{"camera", shipped::item(camera)}},
                                          {{"image", (folder / "a.png").string()}, {"mirror", "upside_down"}})
                                .at("view")
                                .as<marrow::View>();
  EXPECT_EQ(view.image.pixels.at<std::uint8_t>(0, 2), 3 * 6 + 2);
  EXPECT_EQ(marrow::hash_of(view.camera), marrow::hash_of(camera));
}

}  // namespace view_test
