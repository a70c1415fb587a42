// SPDX-License-Identifier: Apache-2.0
#include "tests/plugins/project/made.hpp"
#include "tests/plugins/project/radiograph_behaviour.hpp"

namespace joseph_test {

std::shared_ptr<const marrow::RadiographProjector> make(const marrow::Volume& volume,
                                                        const marrow::SignedField* field) {
  return made::radiographs("project.joseph", volume, field);
}

TEST(Joseph, IntegralsOfACloud) { radiograph_behaviour::integrals_of_a_cloud(make, 0.03, 0.2); }
TEST(Joseph, ChordOfABlock) { radiograph_behaviour::chord_of_a_block(make); }
TEST(Joseph, SmoothedCloud) { radiograph_behaviour::smoothed_cloud(make, 0.25); }
TEST(Joseph, RegionHoldsAll) { radiograph_behaviour::region_holds_all(make); }
TEST(Joseph, GridsAndPixelsAgree) { radiograph_behaviour::grids_and_pixels_agree(make, 0.2); }
TEST(Joseph, AFieldLeavesTheRestOut) { radiograph_behaviour::a_field_leaves_the_rest_out(make); }
TEST(Joseph, SourceWithin) { radiograph_behaviour::source_within(make); }
TEST(Joseph, RefusesNonsense) { radiograph_behaviour::refuses_nonsense(make); }

}  // namespace joseph_test
