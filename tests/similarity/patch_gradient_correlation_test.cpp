// SPDX-License-Identifier: Apache-2.0
#include "plugins/similarity/patch_gradient_correlation.cpp"

#include "intensity_behaviour.hpp"

namespace {

std::shared_ptr<const marrow::Cost> make(const marrow::RadiographProjector& projector,
                                         const marrow::List<marrow::View>& views) {
  return patch_gradient_correlation(projector, views, nullptr, nullptr, nullptr, PatchOptions{});
}

}  // namespace

TEST(PatchGradientCorrelation, IsBestAtTheTruth) { intensity_behaviour::is_best_at_the_truth(make); }
TEST(PatchGradientCorrelation, IsUnmovedByBrightness) { intensity_behaviour::is_unmoved_by_brightness(make); }
TEST(PatchGradientCorrelation, NothingIsTheWorst) { intensity_behaviour::nothing_is_the_worst(make, 2); }
TEST(PatchGradientCorrelation, LevelsCompareFewerPixels) { intensity_behaviour::levels_compare_fewer_pixels(make); }
TEST(PatchGradientCorrelation, RefusesNonsense) { intensity_behaviour::refuses_nonsense(make); }
