// SPDX-License-Identifier: Apache-2.0
#include "plugins/deviations/metal_rims.hpp"
#include "tests/harness/node_test.hpp"

namespace marrow::test::metal_rims_test {

/// 3 pixels a mm at the body, which is 1 m away.
Camera camera() {
  Camera camera;
  camera.width_px = camera.height_px = 512;
  camera.intrinsics << 3000, 0, 256, 0, 3000, 256, 0, 0, 1;
  return camera;
}
RigidTransform placed() { return {"world", "ct", Matrix3d::Identity(), {0, 0, 1000}}; }

/// A prism along y. Its section is a triangle whose sharp edge points to -x: the path along z grows by 1 mm a mm.
Mesh wedge() {
  Mesh mesh;
  for (const double y : {-40.0, 40.0})
    for (const Vector2d& at : {Vector2d(-20, 0), Vector2d(20, 20), Vector2d(20, -20)})
      mesh.vertices_mm.emplace_back(at.x(), y, at.y());
  mesh.triangles = {{0, 2, 1}, {3, 4, 5}, {0, 1, 4}, {0, 4, 3}, {1, 2, 5}, {1, 5, 4}, {2, 0, 3}, {2, 3, 5}};
  return mesh;
}

TEST(PathLengths, OfABoxAcrossTheBeam) {
  const deviations::PathLengths paths(test::box({0, 0, 0}, {40, 30, 20}), camera(), placed());
  EXPECT_NEAR(paths.at(256, 256), 20, 1e-3);
  EXPECT_NEAR(paths.at(256 + 30, 256), 20 * std::hypot(1, 0.01), 1e-3) << "the ray is slanted";
  EXPECT_EQ(paths.at(256 + 70, 256), 0);
  EXPECT_EQ(paths.at(-5, 700), 0);
}

/// The edge of the wedge is at x = -20 mm, pixel 196.
double inside_px(const Mesh& mesh, double edge_px, const deviations::Rim& rim) {
  OutlinePoint point;
  point.u_px = float(edge_px), point.v_px = 256, point.normal_u = -1;
  return edge_inside_px(deviations::PathLengths(mesh, camera(), placed()), point, rim);
}

// Along a wedge, the radiation falls as exp(-d / t). Its slope, blurred by a Gaussian, is the density of a normal and
// an exponential variable together, whose mode is from scipy.stats.exponnorm.
TEST(EdgeInside, OfAWedgeIsTheModeOfItsBlurredSlope) {
  ASSERT_TRUE(is_closed(wedge()));
  EXPECT_NEAR(inside_px(wedge(), 196, {1 / 3.0, 2}), 0.856, 0.25);
  EXPECT_NEAR(inside_px(wedge(), 196, {2, 2}), 2.431, 0.25);
}

TEST(EdgeInside, OfABoxIsItsBorder) {
  EXPECT_NEAR(inside_px(test::box({0, 0, 0}, {40, 30, 20}), 256 - 3000 * 20 / 990.0, {1, 2}), 0, 0.25);
}

}  // namespace marrow::test::metal_rims_test
