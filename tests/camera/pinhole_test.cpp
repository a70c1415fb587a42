// SPDX-License-Identifier: Apache-2.0
#include "plugins/camera/pinhole.cpp"

#include <gtest/gtest.h>

namespace {

TEST(PinholeCamera, ProjectsByEquations1To3) {
  Options options;
  options.width_px = 640;
  options.height_px = 480;
  options.intrinsics = {1000, 0, 320, 0, 500, 240, 0, 0, 1};
  options.rotation = {0, -1, 0, 1, 0, 0, 0, 0, 1};
  options.translation_mm = {1, 2, 100};
  const marrow::Camera camera = pinhole(options);
  // x_camera = (-y + 1, x + 2, z + 100) = (-19, 12, 130)
  const Eigen::Vector2d pixel = project(camera, {10, 20, 30});
  EXPECT_NEAR(pixel.x(), 1000 * -19 / 130.0 + 320, 1e-10);
  EXPECT_NEAR(pixel.y(), 500 * 12 / 130.0 + 240, 1e-10);
}

std::string message(const Options& options) {
  try {
    pinhole(options);
  } catch (const marrow::Error& error) {
    return error.what();
  }
  return "";
}

TEST(PinholeCamera, DiagnosesWrongMatrices) {
  Options options;
  options.rotation = {1, 0, 0, 0, 1, 0, 0, 0, -1};
  EXPECT_NE(message(options).find("not a rotation"), std::string::npos);
  options = {};
  options.intrinsics[8] = 2;
  EXPECT_EQ(message(options), "camera.pinhole: the camera matrix is not [f_u s u_0; 0 f_v v_0; 0 0 1], row by row");
  options = {};
  options.intrinsics[0] = -5;
  EXPECT_NE(message(options).find("positive focal lengths"), std::string::npos);
}

}  // namespace
