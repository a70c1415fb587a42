// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include "intensity_behaviour.hpp"

namespace patch_gradient_correlation_test {

constexpr const char* kNode = "similarity.patch_gradient_correlation";

TEST(PatchGradientCorrelation, IsBestAtTheTruth) { intensity_behaviour::is_best_at_the_truth(kNode); }
TEST(PatchGradientCorrelation, IsUnmovedByBrightness) { intensity_behaviour::is_unmoved_by_brightness(kNode); }
TEST(PatchGradientCorrelation, NothingIsTheWorst) { intensity_behaviour::nothing_is_the_worst(kNode, 2); }
TEST(PatchGradientCorrelation, LevelsCompareFewerPixels) { intensity_behaviour::levels_compare_fewer_pixels(kNode); }
TEST(PatchGradientCorrelation, RefusesNonsense) { intensity_behaviour::refuses_nonsense(kNode); }

}  // namespace patch_gradient_correlation_test
