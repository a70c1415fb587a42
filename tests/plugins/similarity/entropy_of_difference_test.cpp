// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include "intensity_behaviour.hpp"

namespace entropy_of_difference_test {

constexpr const char* kNode = "similarity.entropy_of_difference";

TEST(EntropyOfDifference, IsBestAtTheTruth) { intensity_behaviour::is_best_at_the_truth(kNode, false); }
TEST(EntropyOfDifference, IsUnmovedByBrightness) { intensity_behaviour::is_unmoved_by_brightness(kNode); }
TEST(EntropyOfDifference, NothingIsTheWorst) { intensity_behaviour::nothing_is_the_worst(kNode, 2); }
TEST(EntropyOfDifference, LevelsCompareFewerPixels) { intensity_behaviour::levels_compare_fewer_pixels(kNode); }
TEST(EntropyOfDifference, PredictsNoDeviations) { intensity_behaviour::has_no_blocks(kNode); }
TEST(EntropyOfDifference, RefusesNonsense) { intensity_behaviour::refuses_nonsense(kNode); }

}  // namespace entropy_of_difference_test
