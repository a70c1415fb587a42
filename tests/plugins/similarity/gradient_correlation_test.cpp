// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include "intensity_behaviour.hpp"

namespace gradient_correlation_test {

constexpr const char* kNode = "similarity.gradient_correlation";

TEST(GradientCorrelation, IsBestAtTheTruth) { intensity_behaviour::is_best_at_the_truth(kNode); }
TEST(GradientCorrelation, IsUnmovedByBrightness) { intensity_behaviour::is_unmoved_by_brightness(kNode); }
TEST(GradientCorrelation, NothingIsTheWorst) { intensity_behaviour::nothing_is_the_worst(kNode, 2); }
TEST(GradientCorrelation, LevelsCompareFewerPixels) { intensity_behaviour::levels_compare_fewer_pixels(kNode); }
TEST(GradientCorrelation, RefusesNonsense) { intensity_behaviour::refuses_nonsense(kNode); }

}  // namespace gradient_correlation_test
