// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include "intensity_behaviour.hpp"

namespace gradient_difference_test {

constexpr const char* kNode = "similarity.gradient_difference";

TEST(GradientDifference, IsBestAtTheTruth) { intensity_behaviour::is_best_at_the_truth(kNode); }
TEST(GradientDifference, IsUnmovedByBrightness) { intensity_behaviour::is_unmoved_by_brightness(kNode); }
TEST(GradientDifference, NothingIsTheWorst) { intensity_behaviour::nothing_is_the_worst(kNode, 2); }
TEST(GradientDifference, LevelsCompareFewerPixels) { intensity_behaviour::levels_compare_fewer_pixels(kNode); }
TEST(GradientDifference, RefusesNonsense) { intensity_behaviour::refuses_nonsense(kNode); }

}  // namespace gradient_difference_test
