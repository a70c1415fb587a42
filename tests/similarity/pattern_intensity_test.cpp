// SPDX-License-Identifier: Apache-2.0
#include "plugins/similarity/pattern_intensity.cpp"

#include "intensity_behaviour.hpp"

namespace {

std::shared_ptr<const marrow::Cost> make(const marrow::RadiographProjector& projector,
                                         const marrow::List<marrow::View>& views) {
  return pattern_intensity(projector, views, nullptr, nullptr, nullptr, Options{});
}

}  // namespace

TEST(PatternIntensity, IsBestAtTheTruth) { intensity_behaviour::is_best_at_the_truth(make); }
TEST(PatternIntensity, IsUnmovedByBrightness) { intensity_behaviour::is_unmoved_by_brightness(make); }
TEST(PatternIntensity, NothingIsTheWorst) { intensity_behaviour::nothing_is_the_worst(make, 2); }
TEST(PatternIntensity, LevelsCompareFewerPixels) { intensity_behaviour::levels_compare_fewer_pixels(make); }
TEST(PatternIntensity, RefusesNonsense) { intensity_behaviour::refuses_nonsense(make); }
