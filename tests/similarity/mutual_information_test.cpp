// SPDX-License-Identifier: Apache-2.0
#include "plugins/similarity/mutual_information.cpp"

#include "intensity_behaviour.hpp"

namespace {

std::shared_ptr<const marrow::Cost> make(const marrow::RadiographProjector& projector,
                                         const marrow::List<marrow::View>& views) {
  return mutual_information(projector, views, nullptr, nullptr, nullptr, Options{});
}

}  // namespace

TEST(MutualInformation, IsBestAtTheTruth) { intensity_behaviour::is_best_at_the_truth(make); }
TEST(MutualInformation, IsUnmovedByBrightness) { intensity_behaviour::is_unmoved_by_brightness(make); }
TEST(MutualInformation, NothingIsTheWorst) { intensity_behaviour::nothing_is_the_worst(make, 1); }
TEST(MutualInformation, LevelsCompareFewerPixels) { intensity_behaviour::levels_compare_fewer_pixels(make); }
TEST(MutualInformation, RefusesNonsense) { intensity_behaviour::refuses_nonsense(make); }
