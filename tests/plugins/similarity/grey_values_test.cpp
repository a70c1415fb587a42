// SPDX-License-Identifier: Apache-2.0
// What every cost of grey values must do, on two dark blobs whose radiograph is a formula.
#include "blob_scene.hpp"

namespace grey_values_test {

using namespace blob_scene;

struct Node {
  const char* name;
  double worst = 2;
  bool has_blocks = true, has_slope = true;
};
void PrintTo(const Node& node, std::ostream* stream) { *stream << node.name; }

constexpr const char* kCorrelation = "similarity.normalised_cross_correlation";

/// The cost that a node gives with its defaults.
std::shared_ptr<const Cost> make(const std::string& node, const List<View>& views) {
  static const auto projector = std::make_shared<const BlobProjector>();  // the cost refers to it
  const shipped::Inputs inputs{{"projector", marrow::Value::of<RadiographProjector>(projector)},
                               {"views", shipped::list(views, "view")}};
  return std::static_pointer_cast<const Cost>(shipped::call(node, inputs).at("cost").data);
}

class GreyValueCost : public testing::TestWithParam<Node> {
 protected:
  std::shared_ptr<const Cost> cost_of(const View& view) const { return make(GetParam().name, views_of(view)); }
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
  const double best = cost->value(at(0, 0));
  for (const auto& [u, v] : std::vector<std::pair<double, double>>{{1, 0}, {0, 1}, {-0.7, 0.7}}) {
    double before = best;
    for (const double distance : {2.0, 4.0, 7.0}) {
      const double value = cost->value(at(distance * u, distance * v));
      EXPECT_GT(value, before) << "off by " << distance * u << ", " << distance * v;
      if (GetParam().has_slope) before = value;
    }
  }
}

TEST_P(GreyValueCost, IsUnmovedByBrightness) {
  const auto one = cost_of(view_of(50000, 0.02, 0)), darker = cost_of(view_of(25000, 0.02, 0));
  EXPECT_NEAR(one->value(at(3, 2)), darker->value(at(3, 2)), 0.01);
}

/// If there is nothing to compare, the cost is the worst, and never NaN.
TEST_P(GreyValueCost, NothingIsTheWorst) {
  View view = view_of();
  EXPECT_EQ(cost_of(view)->value(at(500, 0)), GetParam().worst) << "out of the image";
  View constant = view;
  constant.image.pixels = cv::Mat(170, 200, CV_16U, cv::Scalar(30000));
  const double even = cost_of(constant)->value(at(0, 0));
  EXPECT_TRUE(std::isfinite(even));
  EXPECT_GT(even, cost_of(view)->value(at(0, 0)));
  View masked = view;
  masked.mask = cv::Mat(170, 200, CV_8U, cv::Scalar(0));
  EXPECT_TRUE(std::isfinite(cost_of(masked)->value(at(0, 0))));
  View few = masked;
  few.mask(cv::Rect(89, 79, 3, 3)).setTo(1);
  EXPECT_EQ(cost_of(few)->value(at(0, 0)), cost_of(masked)->value(at(0, 0))) << "nine pixels say no more than none";
  View black = view;
  black.image.pixels = cv::Mat(170, 200, CV_16U, cv::Scalar(0));
  EXPECT_TRUE(std::isfinite(cost_of(black)->value(at(0, 0))));
  View nan = view;
  view.image.pixels.convertTo(nan.image.pixels, CV_32F);
  nan.image.pixels.at<float>(80, 90) = std::nanf("");
  EXPECT_TRUE(std::isfinite(cost_of(nan)->value(at(0, 0)))) << "a pixel that is not a number is left out";
}

TEST_P(GreyValueCost, LevelsCompareFewerPixels) {
  const auto cost = cost_of(view_of())->at_level({1, 1, 4});
  EXPECT_LT(cost->value(at(0, 0)), cost->value(at(5, 0)));
  const auto same = cost_of(view_of());
  EXPECT_EQ(same->at_level({1, 1, 0})->value(at(1, 0)), same->value(at(1, 0)));
}

TEST_P(GreyValueCost, RefusesNonsense) {
  View broken = view_of();
  broken.camera.width_px = 10;
  EXPECT_THROW(cost_of(broken), marrow::Error);
  EXPECT_THROW(make(GetParam().name, {}), marrow::Error);
}

/// A cost gives no blocks if they say nothing about its error. So no deviations are predicted from it.
TEST_P(GreyValueCost, HasNoBlocksIfItPredictsNoDeviations) {
  if (GetParam().has_blocks) return;
  const auto cost = cost_of(view_of());
  EXPECT_EQ(cost->without_each_block(at(1, 0.5)), std::vector<double>());
  EXPECT_EQ(cost->at_level({4, 8, 1})->without_each_block(at(1, 0.5)), std::vector<double>());
}

/// The cost without a block equals the cost with a mask that excludes the block.
TEST(NormalisedCrossCorrelation, BlocksAreMasks) {
  const View whole = view_of();
  const auto cost = make(kCorrelation, views_of(whole));
  const std::vector<double> without = cost->without_each_block(at(1, 0.5));
  ASSERT_EQ(without.size(), 8u * 7) << "of 25 px";
  for (const int block : {7, 20, 28, 35}) {
    View view = whole;
    view.mask = cv::Mat(170, 200, CV_8U, cv::Scalar(255));
    cv::rectangle(view.mask, cv::Rect(block % 8 * 25, block / 8 * 25, 25, 25), 0, cv::FILLED);
    EXPECT_NEAR(without[std::size_t(block)], make(kCorrelation, views_of(view))->value(at(1, 0.5)), 1e-12) << block;
  }
  EXPECT_EQ(without[7], cost->value(at(1, 0.5)));
  EXPECT_NE(without[28], cost->value(at(1, 0.5)));
}

// All costs of grey values share this.
TEST(NormalisedCrossCorrelation, SaysWhatIsEmpty) {
  const auto said = [&](const View& view, double u) {
    return make(kCorrelation, views_of(view))->nothing_compared(at(u, 0));
  };
  const View view = view_of();
  EXPECT_EQ(said(view, 0), "");
  EXPECT_EQ(said(view, 500), "view 'frontal': it shows nothing of the bone");
  View constant = view;
  constant.image.pixels = cv::Mat(170, 200, CV_16U, cv::Scalar(30000));
  EXPECT_EQ(said(constant, 0), "view 'frontal': its image is constant where the bone would be");
  View masked = view;
  masked.mask = cv::Mat(170, 200, CV_8U, cv::Scalar(0));
  EXPECT_EQ(said(masked, 0), "view 'frontal': no pixel inside the mask shows the bone");
}

}  // namespace grey_values_test
