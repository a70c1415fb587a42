// SPDX-License-Identifier: Apache-2.0
// Two millimetres in the patient are two millimetres, whatever the shape of a pixel. The figures follow from similar
// triangles: at 600 mm a pixel is 0.3 mm wide and 1.2 mm high.
#include <Eigen/LU>

#include "tests/plugins/evaluate/poses.hpp"
#include "tests/plugins/initial/tube.hpp"

namespace marrow::test::pixels_not_square_test {

using namespace known_poses;

/// Looks along +y from 600 mm before the world's origin: u runs along x, v against z.
View view() {
  View view = even_view("frontal", two_views()[0].camera);
  view.camera.intrinsics(1, 1) = 500;
  return view;
}

TEST(PixelsNotSquare, ProjectionDistances) {
  const auto of = [](const Pose& pose) {
    return call("evaluate.projection_distance",
                {{"pose", item(pose)}, {"truth", exact()}, {"landmarks", origin()}, {"views", each_view(view())}},
                {{"source_to_detector_mm", Numbers{1000}}})
        .at("metrics");
  };
  expect_figures(of(pose_at({2, 0, 0})), {{"mpd_mm", 2}}, 1e-9);
  expect_figures(of(pose_at({0, 0, 2})), {{"mpd_mm", 2}, {"mpd_px", 2 / 1.2}}, 1e-9);
  expect_figures(of(pose_at({3, 0, 4})), {{"mpd_mm", 5}, {"mpd_detector_mm", 5 * 1000 / 600.0}}, 1e-9);
}

/// Of an outline of one point at the world's origin, with its normal along u or v.
double outline_distance_mm(bool along_u, float edge_px) {
  const float u = along_u ? 1.0f : 0.0f, v = 1 - u;
  const EdgeMap edges{512, 512, {{256 + u * edge_px, 256 + v * edge_px, u, v, 10}}};
  const auto projector = outline_of([=](const Camera&, const RigidTransform&, double) {
    return std::vector<OutlinePoint>{{256, 256, u, v, Eigen::Vector3f::Zero()}};
  });
  return figure(call("evaluate.outline_distance", {{"pose", item(Pose())},
                                                   {"projector", function<OutlineProjector>(projector)},
                                                   {"views", each_view(view())},
                                                   {"edges", per_view("frontal", edges)}})
                    .at("metrics"),
                "median_mm");
}

TEST(PixelsNotSquare, OutlineDistances) {
  EXPECT_NEAR(outline_distance_mm(true, 10), 10 * 0.3, 1e-6);
  EXPECT_NEAR(outline_distance_mm(false, 10), 10 * 1.2, 1e-6);
  EXPECT_NEAR(outline_distance_mm(true, 100), 30 * 0.3, 1e-6) << "no edge within reach: the reach itself";
  EXPECT_NEAR(outline_distance_mm(false, 100), 30 * 1.2, 1e-6);
}

// A cylinder of 28 mm that is inclined in the image, so that width and angle depend on the shape of the pixels. Its
// borders are the true ones, turned by a degree in the patient.
TEST(PixelsNotSquare, BordersOfAShaft) {
  constexpr double kRadius_mm = 14;
  const RigidTransform inclined = placed({0, 0, 0}, {0, 0.5, 0});
  const ShaftLines exact = tube::borders(view().camera, {0, 0, 0}, inclined.rotation.col(2), kRadius_mm, 230, 282);
  const auto figure = [&](const ShaftLines& lines, const std::string& name) {
    return shipped::figure(
        call("evaluate.shaft_lines", {{"lines", item(lines)},
                                      {"view", item(view())},
                                      {"models", per_fragment("distal", tube::cylinder(kRadius_mm, 100))},
                                      {"truths", per_fragment("distal", Truth{inclined})}})
            .at("metrics"),
        name);
  };
  // At the depth of the outline, kRadius^2 / 600 before the axis, the borders are 2 (600 - that) tan(half) apart, where
  // the source sees the cylinder at an angle of twice asin(kRadius / 600).
  EXPECT_NEAR(figure(exact, "true_width_mm"),
              2 * (600 - kRadius_mm * kRadius_mm / 600) * std::tan(std::asin(kRadius_mm / 600)), 0.06)
      << "the mesh has 180 sides, so its outline is up to a millimetre nearer or deeper";
  EXPECT_NEAR(figure(exact, "width_error_mm"), 0, 0.02);
  ShaftLines turned = exact;
  const Eigen::Matrix2d mm_from_px = Vector2d(0.3, 1.2).asDiagonal();
  const Vector2d middle = 0.5 * (exact.left.from_px + exact.left.to_px);
  for (Vector2d* end : {&turned.left.from_px, &turned.left.to_px})
    *end = middle + mm_from_px.inverse() * Eigen::Rotation2Dd(radians(1)) * mm_from_px * (*end - middle);
  EXPECT_NEAR(figure(turned, "border_angle_deg"), 1, 0.02);
}

}  // namespace marrow::test::pixels_not_square_test
