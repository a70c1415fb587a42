// SPDX-License-Identifier: Apache-2.0
#include "plugins/similarity/gradient_orientation.cpp"

#include "intensity_behaviour.hpp"

namespace {

std::shared_ptr<const marrow::Cost> make(const marrow::RadiographProjector& projector,
                                         const marrow::List<marrow::View>& views) {
  return gradient_orientation(projector, views, nullptr, nullptr, nullptr, marrow::match::IntensityOptions{});
}

}  // namespace

TEST(GradientOrientation, IsBestAtTheTruth) { intensity_behaviour::is_best_at_the_truth(make); }
TEST(GradientOrientation, IsUnmovedByBrightness) { intensity_behaviour::is_unmoved_by_brightness(make); }
TEST(GradientOrientation, NothingIsTheWorst) { intensity_behaviour::nothing_is_the_worst(make, 1); }
TEST(GradientOrientation, LevelsCompareFewerPixels) { intensity_behaviour::levels_compare_fewer_pixels(make); }
TEST(GradientOrientation, RefusesNonsense) { intensity_behaviour::refuses_nonsense(make); }
