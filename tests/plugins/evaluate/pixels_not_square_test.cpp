// SPDX-License-Identifier: Apache-2.0
// Two millimetres in the patient are two millimetres, whatever the shape of a pixel. The figures follow from similar
// triangles: at 600 mm a pixel is 0.3 mm wide and 1.2 mm high.
#include <gtest/gtest.h>

#include <Eigen/LU>

#include "tests/plugins/evaluate/poses.hpp"
#include "tests/plugins/initial/tube.hpp"

namespace pixels_not_square_test {

using namespace known_poses;

constexpr double kWide_px = 2000, kHigh_px = 500;  ///< focal lengths

/// Looks along +y from 600 mm before the world's origin: u runs along x, v against z.
marrow::View view() {
  marrow::View view = two_views()[0];
  view.camera.intrinsics << kWide_px, 0, 256, 0, kHigh_px, 256, 0, 0, 1;
  view.image.pixels = cv::Mat(512, 512, CV_8U, cv::Scalar(128));
  return view;
}

marrow::List<marrow::View> views() {
  marrow::List<marrow::View> views;
  views.add("frontal", view());
  return views;
}

TEST(PixelsNotSquare, ProjectionDistances) {
  const auto mm = [](const marrow::Pose& pose, const std::string& name) {
    return shipped::figure(shipped::call("evaluate.projection_distance",
                                         {{"pose", shipped::item(pose)},
                                          {"truth", exact()},
                                          {"landmarks", origin()},
                                          {"views", shipped::list(views(), "view")}},
                                         {{"source_to_detector_mm", std::vector<double>{1000}}})
                               .at("metrics"),
                           name);
  };
  EXPECT_NEAR(mm(shifted(2, 0, 0), "mpd_mm"), 2, 1e-9);
  EXPECT_NEAR(mm(shifted(0, 0, 2), "mpd_mm"), 2, 1e-9);
  EXPECT_NEAR(mm(shifted(3, 0, 4), "mpd_mm"), 5, 1e-9);
  EXPECT_NEAR(mm(shifted(3, 0, 4), "mpd_detector_mm"), 5 * 1000 / 600.0, 1e-9);
  EXPECT_NEAR(mm(shifted(0, 0, 2), "mpd_px"), 2 / 1.2, 1e-9);
}

/// An outline of one point at the world's origin, with its normal along a direction of the image.
class PointProjector : public marrow::OutlineProjector {
 public:
  explicit PointProjector(bool along_u) : along_u_(along_u) {}
  std::vector<marrow::OutlinePoint> outline(const marrow::Camera&, const marrow::RigidTransform&,
                                            double) const override {
    return {{256, 256, along_u_ ? 1.0f : 0.0f, along_u_ ? 0.0f : 1.0f, Eigen::Vector3f::Zero()}};
  }

 private:
  bool along_u_;
};

double outline_distance_mm(bool along_u, float edge_px) {
  marrow::EdgeMap edges{512, 512, {{256, 256, along_u ? 1.0f : 0.0f, along_u ? 0.0f : 1.0f, 10}}};
  (along_u ? edges.pixels[0].u_px : edges.pixels[0].v_px) += edge_px;
  marrow::List<marrow::EdgeMap> all;
  all.add("frontal", edges);
  const auto projector = std::make_shared<const PointProjector>(along_u);
  return shipped::figure(
      shipped::call("evaluate.outline_distance", {{"pose", shipped::item(marrow::Pose())},
                                                  {"projector", marrow::Value::of<marrow::OutlineProjector>(projector)},
                                                  {"views", shipped::list(views(), "view")},
                                                  {"edges", shipped::list(all, "view")}})
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
  const Eigen::Vector3d direction = marrow::rotation_from_vector({0, 0.5, 0}).col(2);
  marrow::Truth truth;
  truth.world_from_model.rotation = marrow::rotation_from_vector({0, 0.5, 0});
  const marrow::Camera camera = view().camera;
  const marrow::ShaftLines exact = tube::borders(camera, {0, 0, 0}, direction, kRadius_mm, 230, 282);
  const double half = std::asin(kRadius_mm / 600);  // of the angle at which the source sees the cylinder
  marrow::List<marrow::Mesh> models;
  models.add("distal", tube::cylinder(kRadius_mm, 100));
  marrow::List<marrow::Truth> truths;
  truths.add("distal", truth);
  const auto figure = [&](const marrow::ShaftLines& lines, const std::string& name) {
    return shipped::figure(shipped::call("evaluate.shaft_lines", {{"lines", shipped::item(lines)},
                                                                  {"view", shipped::item(view())},
                                                                  {"models", shipped::list(models, "fragment")},
                                                                  {"truths", shipped::list(truths, "fragment")}})
                               .at("metrics"),
                           name);
  };
  // At the depth of the outline, kRadius^2 / 600 before the axis, the borders are 2 (600 - that) tan(half) apart.
  const double depth_mm = 600 - kRadius_mm * kRadius_mm / 600;
  EXPECT_NEAR(figure(exact, "true_width_mm"), 2 * depth_mm * std::tan(half), 0.06)
      << "the mesh has 180 sides, so its outline is up to a millimetre nearer or deeper";
  EXPECT_NEAR(figure(exact, "width_error_mm"), 0, 0.02);
  marrow::ShaftLines turned = exact;
  const Eigen::Matrix2d mm_from_px = Eigen::Vector2d(0.3, 1.2).asDiagonal();
  const Eigen::Vector2d middle = 0.5 * (exact.left.from_px + exact.left.to_px);
  for (Eigen::Vector2d* end : {&turned.left.from_px, &turned.left.to_px})
    *end = middle + mm_from_px.inverse() * Eigen::Rotation2Dd(marrow::radians(1)) * mm_from_px * (*end - middle);
  EXPECT_NEAR(figure(turned, "border_angle_deg"), 1, 0.02);
}

}  // namespace pixels_not_square_test
