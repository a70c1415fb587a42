// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include "intensity_behaviour.hpp"

namespace gradient_orientation_test {

constexpr const char* kNode = "similarity.gradient_orientation";

TEST(GradientOrientation, IsBestAtTheTruth) { intensity_behaviour::is_best_at_the_truth(kNode); }
TEST(GradientOrientation, IsUnmovedByBrightness) { intensity_behaviour::is_unmoved_by_brightness(kNode); }
TEST(GradientOrientation, NothingIsTheWorst) { intensity_behaviour::nothing_is_the_worst(kNode, 1); }
TEST(GradientOrientation, LevelsCompareFewerPixels) { intensity_behaviour::levels_compare_fewer_pixels(kNode); }
TEST(GradientOrientation, PredictsNoDeviations) { intensity_behaviour::has_no_blocks(kNode); }
TEST(GradientOrientation, RefusesNonsense) { intensity_behaviour::refuses_nonsense(kNode); }

}  // namespace gradient_orientation_test
