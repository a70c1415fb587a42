// SPDX-License-Identifier: Apache-2.0
#include <cmath>
#include <marrow/domain/camera.hpp>

#include "tests/harness/message_of.hpp"

namespace camera_test {

using Eigen::Vector2d;
using Eigen::Vector3d;
using marrow::test::message_of;

/// Source 1000 mm from the detector and 600 mm before the world's origin, pixels of 0.5 mm by 0.25 mm, principal point
/// off the centre. It looks along the world's +y (from the front of the patient to the back); u runs along +x and v
/// along -z.
marrow::Camera frontal() {
  marrow::Camera camera;
  camera.width_px = 400;
  camera.height_px = 800;
  camera.intrinsics << 2000, 0, 210, 0, 4000, 390, 0, 0, 1;
  camera.camera_from_world.rotation << 1, 0, 0, 0, 0, -1, 0, 1, 0;
  camera.camera_from_world.translation_mm = {0, 0, 600};
  return camera;
}

TEST(Camera, ProjectsByTheChaptersEquations) {
  // Eq 1: x = 30, y = -z = -12 in the camera at depth 600 + 150 = 750 give 1000 * 30 / 750 = 40 mm and -16 mm on the
  // detector; Eq 3: 40 / 0.5 + 210 and -16 / 0.25 + 390 pixels.
  EXPECT_TRUE(project(frontal(), {30, 150, 12}).isApprox(Vector2d(290, 326)));
  EXPECT_TRUE(project(frontal(), {0, 0, 0}).isApprox(Vector2d(210, 390)));
  marrow::Camera camera = frontal();
  camera.intrinsics(0, 1) = 100;
  EXPECT_TRUE(project(camera, {30, 150, 12}).isApprox(Vector2d(290 - 100 * 12 / 750.0, 326)));
  EXPECT_TRUE(std::isnan(project(frontal(), {0, -601, 0}).x()));
  EXPECT_TRUE(std::isnan(project(frontal(), {0, -600, 0}).y()));
  EXPECT_TRUE(source_position_mm(frontal()).isApprox(Vector3d(0, -600, 0)));
  const Vector3d point(30, 150, 12);
  EXPECT_TRUE(ray_direction(frontal(), {290, 326}).isApprox((point - Vector3d(0, -600, 0)).normalized()));
}

TEST(Camera, BackProjectedPlaneHoldsTheSourceAndTheLine) {
  const Vector2d from(50, 700), to(300, 20);
  const Vector3d line = from.homogeneous().cross(to.homogeneous());
  const marrow::Plane plane = back_project_line(frontal(), line);
  EXPECT_NEAR(plane.normal.norm(), 1, 1e-12);
  EXPECT_NEAR(plane.normal.dot(source_position_mm(frontal())), plane.offset_mm, 1e-9);
  for (const Vector2d& pixel : {from, to, Vector2d(0.5 * (from + to))})
    for (double depth_mm : {1.0, 500.0, 900.0}) {
      const Vector3d point = source_position_mm(frontal()) + depth_mm * ray_direction(frontal(), pixel);
      EXPECT_NEAR(plane.normal.dot(point), plane.offset_mm, 1e-8);
    }
  const Vector3d beside = source_position_mm(frontal()) + 900 * ray_direction(frontal(), from + Vector2d(10, 0));
  EXPECT_GT(std::abs(plane.normal.dot(beside) - plane.offset_mm), 1);
}

TEST(Camera, PixelSizeShrinksTowardsTheSource) {
  marrow::Camera camera = frontal();
  camera.intrinsics(1, 1) = 2000;
  EXPECT_DOUBLE_EQ(pixel_size_at_mm(camera, {0, 0, 0}), 0.3);
  EXPECT_DOUBLE_EQ(pixel_size_at_mm(camera, {50, 400, -20}), 0.5);
  EXPECT_DOUBLE_EQ(pixel_size_at_mm(frontal(), {0, 0, 0}), 600 / std::sqrt(2000.0 * 4000)) << "the pixel's area";
}

// A finite difference of project(): a point that moves by the offset in mm moves its image by the offset in pixels.
// With focal lengths of 2000 and 4000 pixels at 600 mm, (3, 4) pixels are 0.9 mm and 0.6 mm by hand.
TEST(Camera, AnOffsetInTheImageInMillimetres) {
  marrow::Camera camera = frontal();
  camera.intrinsics(0, 0) = 2000;
  camera.intrinsics(1, 1) = 4000;
  EXPECT_TRUE(offset_at_mm(camera, {0, 0, 0}, {3, 4}).isApprox(Vector2d(0.9, 0.6), 1e-12));
  camera.intrinsics(0, 1) = 150;  // skewed
  const Vector3d point(50, 40, -20);
  for (const Vector2d& offset_px : {Vector2d(1, 0), Vector2d(0, 1), Vector2d(-3, 2)}) {
    constexpr double kSmall = 1e-5;
    const Vector2d mm = kSmall * offset_at_mm(camera, point, offset_px);
    const Vector3d moved = point + camera.camera_from_world.rotation.transpose() * Vector3d(mm.x(), mm.y(), 0);
    EXPECT_TRUE(((project(camera, moved) - project(camera, point)) / kSmall).isApprox(offset_px, 1e-6));
  }
}

TEST(Camera, CheckNamesTheFault) {
  const auto message = [](auto change) {
    marrow::Camera camera = frontal();
    change(camera);
    return message_of([&] { check_camera(camera, "view 'a'"); });
  };
  const auto expect_part = [&](auto change, const std::string& part) {
    EXPECT_NE(message(change).find(part), std::string::npos) << message(change);
  };
  EXPECT_EQ(message([](auto&) {}), "");
  EXPECT_EQ(message([](auto& c) { c.width_px = c.height_px = 1; }), "");
  EXPECT_EQ(message([](auto& c) { c.height_px = 0; }), "view 'a': image size 400 x 0 pixels is not positive");
  expect_part([](auto& c) { c.width_px = -1; }, "image size -1 x 800");
  expect_part([](auto& c) { c.width_px = 65537; }, "expected at most 65536 each way");
  expect_part([](auto& c) { c.intrinsics(0, 0) = 0; }, "needs positive focal lengths");
  EXPECT_EQ(message([](auto& c) { c.intrinsics(1, 1) = -1; }),
            "view 'a': the camera matrix needs positive focal lengths in its first two diagonal places");
  expect_part([](auto& c) { c.intrinsics(2, 2) = 2; },
              "view 'a': the camera matrix is not [f_u s u_0; 0 f_v v_0; 0 0 1]");
  EXPECT_NE(message([](auto& c) { c.intrinsics(1, 0) = 5; }), "");
  expect_part([](auto& c) { c.intrinsics.transposeInPlace(); }, "it looks transposed");
  EXPECT_NE(message([](auto& c) { c.intrinsics(0, 2) = std::nan(""); }), "");
  expect_part([](auto& c) { c.camera_from_world.rotation *= 2; }, "not a rotation");
}

TEST(Camera, DistortionThatMoreThanDoublesTheImageIsRefused) {
  // The corner is at radius 0.5 sqrt(2) of the normalised image, so its square is 0.5.
  Eigen::Matrix3d intrinsics;
  intrinsics << 1000, 0, 499.5, 0, 1000, 499.5, 0, 0, 1;
  const auto fault = [&](double factor_at_corner) {
    marrow::RadialDistortion distortion;
    distortion.k[0] = (factor_at_corner - 1) / 0.5;
    return message_of([&] { check_distortion(intrinsics, distortion, 1000, 1000, "camera 'c'"); });
  };
  EXPECT_EQ(fault(1.95), "");
  EXPECT_TRUE(fault(2.1).starts_with("camera 'c': the radial distortion folds the image or more than doubles it, "))
      << fault(2.1);
}

TEST(View, CheckNamesTheFault) {
  const auto message = [](int width, int height, const cv::Mat& mask = {}) {
    return message_of([&] {
      check_view(marrow::View{"lateral", {cv::Mat(height, width, CV_8U, cv::Scalar(0))}, frontal(), mask});
    });
  };
  const auto mask = [](int width, int height) { return cv::Mat(height, width, CV_8U, cv::Scalar(0)); };
  EXPECT_EQ(message(400, 800), "");
  EXPECT_EQ(message(400, 800, mask(401, 800)), "view 'lateral': the mask has 401 x 800 pixels, the image 400 x 800");
  EXPECT_EQ(message(400, 800, mask(400, 799)), "view 'lateral': the mask has 400 x 799 pixels, the image 400 x 800");
  for (const auto& [width, height] : {std::pair(400, 801), {399, 800}, {512, 512}})
    EXPECT_EQ(message(width, height), "view 'lateral': the image has " + std::to_string(width) + " x " +
                                          std::to_string(height) +
                                          " pixels, but its camera is for 400 x 800; give the camera that belongs to "
                                          "this image");
  EXPECT_EQ(message(0, 0), "view 'lateral': the image is empty");
}

/// A view from `source`, whose central ray goes through `aim`.
marrow::View aimed(const Vector3d& source, const Vector3d& aim) {
  marrow::View view;
  view.camera.width_px = view.camera.height_px = 100;
  view.camera.intrinsics << 1000, 0, 20, 0, 1000, 70, 0, 0, 1;
  const Vector3d z = (aim - source).normalized(), x = z.unitOrthogonal();
  view.camera.camera_from_world.rotation << x.transpose(), z.cross(x).transpose(), z.transpose();
  view.camera.camera_from_world.translation_mm = -(view.camera.camera_from_world.rotation * source);
  return view;
}
marrow::List<marrow::View> both(const marrow::View& one, const marrow::View& other) {
  marrow::List<marrow::View> views;
  views.add("one", one);
  views.add("other", other);
  return views;
}

TEST(CentralRays, MeetWhereTheyAreAimed) {
  const Vector3d aim(120, -340, 55);
  const auto met = marrow::meeting_point_mm(both(aimed({700, 0, 0}, aim), aimed({0, 300, 200}, aim)));
  ASSERT_TRUE(met);
  EXPECT_LT((*met - aim).norm(), 1e-9);
}

TEST(CentralRays, ThatMissEachOtherMeetHalfWay) {
  // One runs along x at z = 0, the other along y at z = 10.
  const auto met = marrow::meeting_point_mm(both(aimed({-600, 0, 0}, {0, 0, 0}), aimed({7, -600, 10}, {7, 0, 10})));
  ASSERT_TRUE(met);
  EXPECT_LT((*met - Vector3d(7, 0, 5)).norm(), 1e-9);
}

TEST(CentralRays, DoNotAlwaysTellWhereTheBoneIs) {
  marrow::List<marrow::View> single;
  single.add("one", aimed({0, -600, 0}, {0, 0, 0}));
  EXPECT_FALSE(marrow::meeting_point_mm(single));
  EXPECT_FALSE(marrow::meeting_point_mm({}));
  EXPECT_FALSE(marrow::meeting_point_mm(both(aimed({0, -600, 0}, {0, 0, 0}), aimed({20, -600, 0}, {0, 0, 0}))))
      << "1.9 degrees apart";
  EXPECT_TRUE(marrow::meeting_point_mm(both(aimed({0, -600, 0}, {0, 0, 0}), aimed({40, -600, 0}, {0, 0, 0}))))
      << "3.8 degrees apart";
  EXPECT_FALSE(marrow::meeting_point_mm(both(aimed({0, -600, 0}, {0, -900, 0}), aimed({600, 0, 0}, {900, 0, 0}))))
      << "they meet behind the sources";
}

}  // namespace camera_test
