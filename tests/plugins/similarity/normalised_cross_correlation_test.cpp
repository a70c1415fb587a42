// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include "intensity_behaviour.hpp"

namespace normalised_cross_correlation_test {

constexpr const char* kNode = "similarity.normalised_cross_correlation";

TEST(NormalisedCrossCorrelation, IsBestAtTheTruth) { intensity_behaviour::is_best_at_the_truth(kNode); }
TEST(NormalisedCrossCorrelation, IsUnmovedByBrightness) { intensity_behaviour::is_unmoved_by_brightness(kNode); }
TEST(NormalisedCrossCorrelation, NothingIsTheWorst) { intensity_behaviour::nothing_is_the_worst(kNode, 2); }
TEST(NormalisedCrossCorrelation, LevelsCompareFewerPixels) { intensity_behaviour::levels_compare_fewer_pixels(kNode); }
TEST(NormalisedCrossCorrelation, BlocksAreMasks) { intensity_behaviour::blocks_are_masks(kNode); }
TEST(NormalisedCrossCorrelation, RefusesNonsense) { intensity_behaviour::refuses_nonsense(kNode); }

// The same for all costs of grey values, which share it.
TEST(NormalisedCrossCorrelation, SaysWhatIsEmpty) {
  using namespace intensity_behaviour;
  const auto projector = std::make_shared<const BlobProjector>();
  const auto said = [&](const View& view, double u) {
    return make(kNode, projector, views_of(view))->nothing_compared(at(u, 0));
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

}  // namespace normalised_cross_correlation_test
