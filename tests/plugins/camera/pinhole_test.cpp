// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include "shipped.hpp"

namespace pinhole_test {

using Numbers = std::vector<double>;

TEST(PinholeCamera, ProjectsByEquations1To3) {
  const auto outputs = shipped::call("camera.pinhole", {},
                                     {{"width_px", std::int64_t{640}},
                                      {"height_px", std::int64_t{480}},
                                      {"intrinsics", Numbers{1000, 0, 320, 0, 500, 240, 0, 0, 1}},
                                      {"rotation", Numbers{0, -1, 0, 1, 0, 0, 0, 0, 1}},
                                      {"translation_mm", Numbers{1, 2, 100}}});
  const auto& camera = outputs.at("camera").as<marrow::Camera>();
  // x_camera = (-y + 1, x + 2, z + 100) = (-19, 12, 130)
  const Eigen::Vector2d pixel = project(camera, {10, 20, 30});
  EXPECT_NEAR(pixel.x(), 1000 * -19 / 130.0 + 320, 1e-10);
  EXPECT_NEAR(pixel.y(), 500 * 12 / 130.0 + 240, 1e-10);
}

std::string message(const std::string& option, const Numbers& values) {
  return shipped::refusal("camera.pinhole", {}, {{option, values}});
}

TEST(PinholeCamera, DiagnosesWrongMatrices) {
  EXPECT_NE(message("rotation", {1, 0, 0, 0, 1, 0, 0, 0, -1}).find("not a rotation"), std::string::npos);
  EXPECT_EQ(message("intrinsics", {1706.5, 0, 255.5, 0, 1706.5, 255.5, 0, 0, 2}),
            "camera.pinhole: the camera matrix is not [f_u s u_0; 0 f_v v_0; 0 0 1], row by row");
  EXPECT_NE(message("intrinsics", {-5, 0, 255.5, 0, 1706.5, 255.5, 0, 0, 1}).find("positive focal lengths"),
            std::string::npos);
}

}  // namespace pinhole_test
