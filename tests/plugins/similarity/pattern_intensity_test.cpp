// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include "intensity_behaviour.hpp"

namespace pattern_intensity_test {

constexpr const char* kNode = "similarity.pattern_intensity";

TEST(PatternIntensity, IsBestAtTheTruth) { intensity_behaviour::is_best_at_the_truth(kNode); }
TEST(PatternIntensity, IsUnmovedByBrightness) { intensity_behaviour::is_unmoved_by_brightness(kNode); }
TEST(PatternIntensity, NothingIsTheWorst) { intensity_behaviour::nothing_is_the_worst(kNode, 2); }
TEST(PatternIntensity, LevelsCompareFewerPixels) { intensity_behaviour::levels_compare_fewer_pixels(kNode); }
TEST(PatternIntensity, RefusesNonsense) { intensity_behaviour::refuses_nonsense(kNode); }

}  // namespace pattern_intensity_test
