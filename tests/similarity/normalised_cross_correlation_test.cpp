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

}  // namespace normalised_cross_correlation_test
