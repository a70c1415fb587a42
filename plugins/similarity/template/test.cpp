// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <cmath>
#include <marrow/domain/camera.hpp>
#include <marrow/domain/functions.hpp>
#include <marrow/testing/node.hpp>

namespace node_test = marrow::node_test;

namespace {

/// A ball of water with a radius of 20 mm.
class Ball : public marrow::RadiographProjector {
 public:
  std::vector<float> radiograph(const marrow::Camera& camera, const marrow::RigidTransform& world_from_model,
                                const std::vector<Eigen::Vector2f>& pixels) const override {
    const Eigen::Vector3d source = marrow::source_position_mm(camera);
    std::vector<float> values;
    for (const Eigen::Vector2f& pixel : pixels) {
      const Eigen::Vector3d ray = marrow::ray_direction(camera, pixel.cast<double>());
      const double off_mm = (world_from_model.translation_mm - source).cross(ray).norm() / ray.norm();
      values.push_back(off_mm < 20 ? float(2 * std::sqrt(400 - off_mm * off_mm)) : 0);
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

TEST(NewNode, IsLeastWhereTheBallIs) {
  const marrow::CArm arm{128, 128, Eigen::Vector2d::Constant(1), 1000, 600, Eigen::Vector3d::Zero()};
  marrow::View view;
  view.name = "frontal";
  view.camera = marrow::carm_camera(arm, marrow::world_from_camera_rotation(0, 0));
  const auto projector = std::make_shared<const Ball>();
  marrow::RigidTransform at{"world", "ct"};
  const marrow::PixelGrid whole = projector->region(view.camera, at);
  const std::vector<float> depth_mm = projector->radiograph(view.camera, at, whole);
  view.image.pixels = cv::Mat(128, 128, CV_16U);
  for (int i = 0; i < 128 * 128; ++i)
    view.image.pixels.at<std::uint16_t>(i / 128, i % 128) =
        std::uint16_t(40000 * std::exp(-0.02 * depth_mm[std::size_t(i)]));
  marrow::List<marrow::View> views;
  views.add("frontal", view);
  const auto made =
      node_test::call("similarity.new_node", {{"projector", marrow::Value::of<marrow::RadiographProjector>(projector)},
                                              {"views", node_test::list(views, "view")}});
  const auto& cost = made.at("cost").as<marrow::Cost>();
  const double there = cost.value(at);
  for (const double off_mm : {-3.0, 3.0}) {
    at.translation_mm = {off_mm, 0, 0};
    EXPECT_GT(cost.value(at), there);
  }
}
