// SPDX-License-Identifier: Apache-2.0
// What every cost of grey values must do, on two dark blobs whose radiograph is a formula.
#include "tests/plugins/similarity/blob_scene.hpp"

namespace marrow::test::grey_values_test {

using namespace blob_scene;

struct Node {
  const char* name;
  double worst = 2;
  bool has_blocks = true, has_slope = true;
};
void PrintTo(const Node& node, std::ostream* stream) { *stream << node.name; }

constexpr const char* kCorrelation = "similarity.normalised_cross_correlation";

class GreyValueCost : public testing::TestWithParam<Node> {
 protected:
  /// The cost that the node gives with its defaults.
  std::shared_ptr<const Cost> cost_of(const View& view) const { return cost_by(GetParam().name, inputs(view)); }
};
INSTANTIATE_TEST_SUITE_P(
    , GreyValueCost,
    testing::Values(Node{"similarity.entropy_of_difference", 2, false, false}, Node{"similarity.gradient_correlation"},
                    Node{"similarity.gradient_difference"}, Node{"similarity.gradient_orientation", 1, false},
                    Node{"similarity.mutual_information", 1, false}, Node{kCorrelation},
                    Node{"similarity.patch_gradient_correlation"}, Node{"similarity.pattern_intensity"}),
    [](const auto& info) { return std::string(info.param.name).substr(11); });

/// The cost is least at the true pose and rises with the distance from it. Some costs are least there but do not fall
/// towards it from far away (has_slope is false).
TEST_P(GreyValueCost, IsBestAtTheTruth) {
  const auto cost = cost_of(view_of());
  for (const auto& [u, v] : std::vector<std::pair<double, double>>{{1, 0}, {0, 1}, {-0.7, 0.7}}) {
    double before = cost->value(at(0, 0));
    for (const double distance : {2.0, 4.0, 7.0}) {
      const double value = cost->value(at(distance * u, distance * v));
      EXPECT_GT(value, before) << "off by " << distance * u << ", " << distance * v;
      if (GetParam().has_slope) before = value;
    }
  }
}

TEST_P(GreyValueCost, IsUnmovedByBrightness) {
  EXPECT_NEAR(cost_of(view_of(50000, 0.02, 0))->value(at(3, 2)), cost_of(view_of(25000, 0.02, 0))->value(at(3, 2)),
              0.01);
}

/// If there is nothing to compare, the cost is the worst, and never NaN.
TEST_P(GreyValueCost, NothingIsTheWorst) {
  const View view = view_of(), masked = with_mask(view, nothing_shown(camera()));
  const auto value = [&](const View& view) { return cost_of(view)->value(at(0, 0)); };
  EXPECT_EQ(cost_of(view)->value(at(500, 0)), GetParam().worst) << "out of the image";
  EXPECT_TRUE(std::isfinite(value(even(view, 30000))));
  EXPECT_GT(value(even(view, 30000)), value(view));
  EXPECT_TRUE(std::isfinite(value(masked)));
  EXPECT_EQ(value(with_mask(view, mask_of(camera(), {89, 79, 3, 3}))), value(masked))
      << "nine pixels say no more than none";
  EXPECT_TRUE(std::isfinite(value(even(view, 0))));
  View nan = view;
  view.image.pixels.convertTo(nan.image.pixels, CV_32F);
  nan.image.pixels.at<float>(80, 90) = std::nanf("");
  EXPECT_TRUE(std::isfinite(value(nan))) << "a pixel that is not a number is left out";
}

TEST_P(GreyValueCost, LevelsCompareFewerPixels) {
  const auto cost = cost_of(view_of()), coarse = cost->at_level({1, 1, 4});
  EXPECT_LT(coarse->value(at(0, 0)), coarse->value(at(5, 0)));
  EXPECT_EQ(cost->at_level({1, 1, 0})->value(at(1, 0)), cost->value(at(1, 0)));
}

TEST_P(GreyValueCost, RefusesNonsense) {
  View broken = view_of();
  broken.camera.width_px = 10;
  EXPECT_THROW(cost_of(broken), Error);
  EXPECT_THROW(cost_by(GetParam().name, with(inputs(), {{"views", each_view(List<View>())}})), Error);
}

/// A cost gives no blocks if they say nothing about its error. So no deviations are predicted from it.
TEST_P(GreyValueCost, HasNoBlocksIfItPredictsNoDeviations) {
  if (GetParam().has_blocks) return;
  const auto cost = cost_of(view_of());
  EXPECT_EQ(cost->without_each_block(at(1, 0.5)), Numbers());
  EXPECT_EQ(cost->at_level({4, 8, 1})->without_each_block(at(1, 0.5)), Numbers());
}

/// The cost without a block equals the cost with a mask that excludes the block.
TEST(NormalisedCrossCorrelation, BlocksAreMasks) {
  const auto cost = cost_by(kCorrelation, inputs());
  const Numbers without = cost->without_each_block(at(1, 0.5));
  ASSERT_EQ(without.size(), 8u * 7) << "of 25 px";
  for (const int block : {7, 20, 28, 35}) {
    const cv::Rect part = cv::Rect(block % 8 * 25, block / 8 * 25, 25, 25) & cv::Rect(0, 0, kWidth_px, kHeight_px);
    const View masked = with_mask(view_of(), mask_of(camera(), part, false));
    EXPECT_NEAR(without[std::size_t(block)], cost_by(kCorrelation, inputs(masked))->value(at(1, 0.5)), 1e-12) << block;
  }
  EXPECT_EQ(without[7], cost->value(at(1, 0.5)));
  EXPECT_NE(without[28], cost->value(at(1, 0.5)));
}

// All costs of grey values share this.
TEST(NormalisedCrossCorrelation, SaysWhatIsEmpty) {
  const auto said = [](const View& view, double u = 0) {
    return cost_by(kCorrelation, inputs(view))->nothing_compared(at(u, 0));
  };
  EXPECT_EQ(said(view_of()), "");
  EXPECT_EQ(said(view_of(), 500), "view 'frontal': it shows nothing of the bone");
  EXPECT_EQ(said(even(view_of(), 30000)), "view 'frontal': its image is constant where the bone would be");
  EXPECT_EQ(said(with_mask(view_of(), nothing_shown(camera()))),
            "view 'frontal': no pixel inside the mask shows the bone");
}

/// exp of minus a formula, in an image of 5 x 5 pixels that patch_correlation compares as one square with another
/// formula.
double one_square(const std::function<double(double, double)>& rendered,
                  const std::function<double(double, double)>& seen) {
  const View small = test::view_of("small", before_origin(pinhole(1000, 5, 5), 600),
                                   image_of<float>(5, 5, [&](int u, int v) { return std::exp(-seen(u, v)); }));
  const auto projector = std::make_shared<const DrawnRadiograph>(
      PixelGrid{0, 0, 1, 5, 5}, [&](const Vector2d& pixel, const auto&) { return rendered(pixel.x(), pixel.y()); });
  return cost_by("similarity.patch_correlation",
                 {{"projector", function<RadiographProjector>(projector)}, {"views", each_view(small)}},
                 {{"pixel_step", std::int64_t(1)},
                  {"margin_px", std::int64_t(0)},
                  {"sigma_steps", 0.0},
                  {"patch_pixels", std::int64_t(5)}})
      ->value(at(0, 0));
}

TEST(PatchCorrelation, IsTheCorrelationOfOneSquare) {
  const auto right = [](double u, double) { return u; };
  EXPECT_NEAR(one_square(right, [](double u, double) { return 0.3 * u + 1; }), 0, 1e-6);
  EXPECT_NEAR(one_square(right, [](double u, double) { return 3 - 0.3 * u; }), 2, 1e-6);
  EXPECT_NEAR(one_square(right, [](double, double v) { return 0.3 * v; }), 1, 1e-6);
  // u against u + v: both vary alike, so r = 1 / sqrt 2.
  EXPECT_NEAR(one_square(right, [](double u, double v) { return 0.2 * (u + v); }), 1 - std::sqrt(0.5), 1e-6);
  EXPECT_NEAR(one_square(right, [](double, double) { return 0.5; }), 1, 1e-6) << "an even image";
  EXPECT_NEAR(one_square([](double, double) { return 7; }, right), 2, 1e-6) << "an even radiograph";
}

TEST(PatchCorrelation, IsBestAtTheTruth) {
  const auto cost = cost_by("similarity.patch_correlation", inputs());
  EXPECT_LT(cost->value(at(0, 0)), 0.05);
  EXPECT_LT(cost->value(at(0, 0)), cost->value(at(2, 0)));
  EXPECT_LT(cost->value(at(2, 0)), cost->value(at(4, 0)));
  EXPECT_EQ(cost->value(at(500, 0)), 2);
}

}  // namespace marrow::test::grey_values_test
