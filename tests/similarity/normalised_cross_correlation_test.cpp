// SPDX-License-Identifier: Apache-2.0
#include "plugins/similarity/normalised_cross_correlation.cpp"

#include "intensity_behaviour.hpp"

namespace {

std::shared_ptr<const marrow::Cost> make(const marrow::RadiographProjector& projector,
                                         const marrow::List<marrow::View>& views) {
  return normalised_cross_correlation(projector, views, nullptr, nullptr, nullptr, marrow::match::IntensityOptions{});
}

}  // namespace

TEST(NormalisedCrossCorrelation, IsBestAtTheTruth) { intensity_behaviour::is_best_at_the_truth(make); }
TEST(NormalisedCrossCorrelation, IsUnmovedByBrightness) { intensity_behaviour::is_unmoved_by_brightness(make); }
TEST(NormalisedCrossCorrelation, NothingIsTheWorst) { intensity_behaviour::nothing_is_the_worst(make, 2); }
TEST(NormalisedCrossCorrelation, LevelsCompareFewerPixels) { intensity_behaviour::levels_compare_fewer_pixels(make); }
TEST(NormalisedCrossCorrelation, RefusesNonsense) { intensity_behaviour::refuses_nonsense(make); }
