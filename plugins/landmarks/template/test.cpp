// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <cmath>
#include <marrow/domain/camera.hpp>
#include <marrow/domain/features.hpp>
#include <marrow/domain/functions.hpp>
#include <marrow/testing/node.hpp>

namespace node_test = marrow::node_test;

namespace {

/// A ball of water with a radius of 8 mm.
class Ball : public marrow::RadiographProjector {
 public:
  std::vector<float> radiograph(const marrow::Camera& camera, const marrow::RigidTransform& world_from_model,
                                const std::vector<Eigen::Vector2f>& pixels) const override {
    const Eigen::Vector3d source = marrow::source_position_mm(camera);
    std::vector<float> values;
    for (const Eigen::Vector2f& pixel : pixels) {
      const Eigen::Vector3d ray = marrow::ray_direction(camera, pixel.cast<double>());
      const double off_mm = (world_from_model.translation_mm - source).cross(ray).norm() / ray.norm();
      values.push_back(off_mm < 8 ? float(2 * std::sqrt(64 - off_mm * off_mm)) : 0);
    }
    return values;
  }
  std::vector<float> radiograph(const marrow::Camera& camera, const marrow::RigidTransform& world_from_model,
                                const marrow::PixelGrid& grid) const override {
    std::vector<Eigen::Vector2f> pixels;
    for (int row = 0; row < grid.rows; ++row)
      for (int column = 0; column < grid.columns; ++column) pixels.push_back(grid.pixel(column, row).cast<float>());
    return radiograph(camera, world_from_model, pixels);
  }
  marrow::PixelGrid region(const marrow::Camera& camera, const marrow::RigidTransform&) const override {
    return {0, 0, 1, camera.width_px, camera.height_px};
  }
};

}  // namespace

TEST(NewNode, FindsTheMiddleOfABall) {
  const marrow::CArm arm{200, 200, Eigen::Vector2d::Constant(0.8), 1000, 600, Eigen::Vector3d::Zero()};
  marrow::View view;
  view.name = "frontal";
  view.camera = marrow::carm_camera(arm, marrow::world_from_camera_rotation(0, 0));
  const auto projector = std::make_shared<const Ball>();
  const marrow::RigidTransform there{"world", "ct", Eigen::Matrix3d::Identity(), {6, 3, -5}};
  const std::vector<float> depth_mm = projector->radiograph(view.camera, there, marrow::PixelGrid{0, 0, 1, 200, 200});
  view.image.pixels = cv::Mat(200, 200, CV_16U);
  for (int i = 0; i < 200 * 200; ++i)
    view.image.pixels.ptr<std::uint16_t>()[i] = std::uint16_t(40000 * std::exp(-0.02 * depth_mm[std::size_t(i)]));
  marrow::Landmarks points;
  points.points = {{"middle", {0, 0, 0}}};
  marrow::List<marrow::View> views;
  views.add(view.name, view);
  marrow::Pose start;
  start.world_from_model = {"world", "ct", Eigen::Matrix3d::Identity(), {0, 0, 0}};
  const auto made =
      node_test::call("landmarks.new_node", {{"points", node_test::item(points)},
                                             {"views", node_test::list(views, "view")},
                                             {"projector", marrow::Value::of<marrow::RadiographProjector>(projector)},
                                             {"start", node_test::item(start)}});
  const auto& seen = made.at("landmarks").as<marrow::Landmarks>().seen;
  ASSERT_EQ(seen.size(), 1u);
  EXPECT_LT((seen[0].pixel - project(view.camera, there.translation_mm)).norm(), 0.5);
  EXPECT_GT(seen[0].deviation_px, 0);
}
