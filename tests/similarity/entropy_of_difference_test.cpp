// SPDX-License-Identifier: Apache-2.0
#include "plugins/similarity/entropy_of_difference.cpp"

#include "intensity_behaviour.hpp"

namespace {

std::shared_ptr<const marrow::Cost> make(const marrow::RadiographProjector& projector,
                                         const marrow::List<marrow::View>& views) {
  return entropy_of_difference(projector, views, nullptr, nullptr, nullptr, Options{});
}

}  // namespace

TEST(EntropyOfDifference, IsBestAtTheTruth) { intensity_behaviour::is_best_at_the_truth(make, false); }
TEST(EntropyOfDifference, IsUnmovedByBrightness) { intensity_behaviour::is_unmoved_by_brightness(make); }
TEST(EntropyOfDifference, NothingIsTheWorst) { intensity_behaviour::nothing_is_the_worst(make, 2); }
TEST(EntropyOfDifference, LevelsCompareFewerPixels) { intensity_behaviour::levels_compare_fewer_pixels(make); }
TEST(EntropyOfDifference, RefusesNonsense) { intensity_behaviour::refuses_nonsense(make); }
