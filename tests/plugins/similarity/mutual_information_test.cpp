// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include "intensity_behaviour.hpp"

namespace mutual_information_test {

constexpr const char* kNode = "similarity.mutual_information";

TEST(MutualInformation, IsBestAtTheTruth) { intensity_behaviour::is_best_at_the_truth(kNode); }
TEST(MutualInformation, IsUnmovedByBrightness) { intensity_behaviour::is_unmoved_by_brightness(kNode); }
TEST(MutualInformation, NothingIsTheWorst) { intensity_behaviour::nothing_is_the_worst(kNode, 1); }
TEST(MutualInformation, LevelsCompareFewerPixels) { intensity_behaviour::levels_compare_fewer_pixels(kNode); }
TEST(MutualInformation, PredictsNoDeviations) { intensity_behaviour::has_no_blocks(kNode); }
TEST(MutualInformation, RefusesNonsense) { intensity_behaviour::refuses_nonsense(kNode); }

}  // namespace mutual_information_test
