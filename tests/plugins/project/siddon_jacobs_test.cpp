// SPDX-License-Identifier: Apache-2.0
#include "tests/plugins/project/made.hpp"
#include "tests/plugins/project/radiograph_behaviour.hpp"

namespace siddon_jacobs_test {

std::shared_ptr<const marrow::RadiographProjector> make(const marrow::Volume& volume,
                                                        const marrow::SignedField* field) {
  return made::radiographs("project.siddon_jacobs", volume, field);
}

TEST(SiddonJacobs, IntegralsOfACloud) { radiograph_behaviour::integrals_of_a_cloud(make, 0.07, 2); }
TEST(SiddonJacobs, ChordOfABlock) { radiograph_behaviour::chord_of_a_block(make); }
TEST(SiddonJacobs, SmoothedCloud) { radiograph_behaviour::smoothed_cloud(make, 1.2); }
TEST(SiddonJacobs, RegionHoldsAll) { radiograph_behaviour::region_holds_all(make); }
TEST(SiddonJacobs, GridsAndPixelsAgree) { radiograph_behaviour::grids_and_pixels_agree(make, 1e-5); }
TEST(SiddonJacobs, AFieldLeavesTheRestOut) { radiograph_behaviour::a_field_leaves_the_rest_out(make); }
TEST(SiddonJacobs, SourceWithin) { radiograph_behaviour::source_within(make); }
TEST(SiddonJacobs, RefusesNonsense) { radiograph_behaviour::refuses_nonsense(make); }

}  // namespace siddon_jacobs_test
