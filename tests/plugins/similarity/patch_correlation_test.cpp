// SPDX-License-Identifier: Apache-2.0
#include <cmath>

#include "blob_scene.hpp"
#include "shipped.hpp"

namespace patch_correlation_test {

using blob_scene::at;
using marrow::RadiographProjector;

/// A radiograph that is a formula of the pixel, wherever the model is.
class FormulaProjector : public pixelwise_projector::PixelwiseProjector {
 public:
  explicit FormulaProjector(std::function<double(double, double)> formula) : formula_(std::move(formula)) {}
  marrow::PixelGrid region(const marrow::Camera&, const marrow::RigidTransform&) const override {
    return {0, 0, 1, 5, 5};
  }

 protected:
  double integral(const Eigen::Vector2d& pixel, const marrow::RigidTransform&) const override {
    return formula_(pixel.x(), pixel.y());
  }

 private:
  std::function<double(double, double)> formula_;
};

/// exp of minus a formula, in an image of 5 x 5 pixels.
marrow::View small_view(const std::function<double(double, double)>& formula) {
  marrow::View view;
  view.name = "small";
  view.camera.width_px = view.camera.height_px = 5;
  view.camera.intrinsics << 1000, 0, 2, 0, 1000, 2, 0, 0, 1;
  view.camera.camera_from_world.translation_mm = {0, 0, 600};
  view.image.pixels = cv::Mat(5, 5, CV_32F);
  for (int v = 0; v < 5; ++v)
    for (int u = 0; u < 5; ++u) view.image.pixels.at<float>(v, u) = float(std::exp(-formula(u, v)));
  return view;
}

double value(const std::function<double(double, double)>& rendered, const std::function<double(double, double)>& seen) {
  const shipped::Inputs inputs{
      {"projector", marrow::Value::of<RadiographProjector>(std::make_shared<const FormulaProjector>(rendered))},
      {"views", shipped::list(blob_scene::views_of(small_view(seen)), "view")}};
  const shipped::Options options{{"pixel_step", std::int64_t(1)},
                                 {"margin_px", std::int64_t(0)},
                                 {"sigma_steps", 0.0},
                                 {"patch_pixels", std::int64_t(5)}};
  const marrow::Value cost = shipped::call("similarity.patch_correlation", inputs, options).at("cost");
  return cost.as<marrow::Cost>().value(at(0, 0));
}

shipped::Inputs blob_inputs(const marrow::View& view) {
  return {{"projector", marrow::Value::of<RadiographProjector>(std::make_shared<const blob_scene::BlobProjector>())},
          {"views", shipped::list(blob_scene::views_of(view), "view")}};
}

TEST(PatchCorrelation, IsTheCorrelationOfOneSquare) {
  const auto right = [](double u, double) { return u; };
  EXPECT_NEAR(value(right, [](double u, double) { return 0.3 * u + 1; }), 0, 1e-6);
  EXPECT_NEAR(value(right, [](double u, double) { return 3 - 0.3 * u; }), 2, 1e-6);
  EXPECT_NEAR(value(right, [](double, double v) { return 0.3 * v; }), 1, 1e-6);
  // u against u + v: both vary alike, so r = 1 / sqrt 2.
  EXPECT_NEAR(value(right, [](double u, double v) { return 0.2 * (u + v); }), 1 - std::sqrt(0.5), 1e-6);
  EXPECT_NEAR(value(right, [](double, double) { return 0.5; }), 1, 1e-6) << "an even image";
  EXPECT_NEAR(value([](double, double) { return 7; }, [](double u, double) { return u; }), 2, 1e-6)
      << "an even radiograph";
}

TEST(PatchCorrelation, IsBestAtTheTruth) {
  const shipped::Inputs inputs = blob_inputs(blob_scene::view_of());
  const marrow::Value cost = shipped::call("similarity.patch_correlation", inputs).at("cost");
  const auto value = [&](double u, double v) { return cost.as<marrow::Cost>().value(at(u, v)); };
  EXPECT_LT(value(0, 0), 0.05);
  EXPECT_LT(value(0, 0), value(2, 0));
  EXPECT_LT(value(2, 0), value(4, 0));
  EXPECT_EQ(value(500, 0), 2);
}

}  // namespace patch_correlation_test
