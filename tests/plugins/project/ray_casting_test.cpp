// SPDX-License-Identifier: Apache-2.0
#include "tests/plugins/project/made.hpp"
#include "tests/plugins/project/radiograph_behaviour.hpp"

namespace ray_casting_test {

std::shared_ptr<const marrow::RadiographProjector> make(const marrow::Volume& volume,
                                                        const marrow::SignedField* field) {
  return made::radiographs("project.ray_casting", volume, field);
}

TEST(RayCasting, IntegralsOfACloud) { radiograph_behaviour::integrals_of_a_cloud(make, 0.03, 0.2); }
TEST(RayCasting, ChordOfABlock) { radiograph_behaviour::chord_of_a_block(make); }
TEST(RayCasting, SmoothedCloud) { radiograph_behaviour::smoothed_cloud(make, 0.25); }
TEST(RayCasting, RegionHoldsAll) { radiograph_behaviour::region_holds_all(make); }
TEST(RayCasting, GridsAndPixelsAgree) { radiograph_behaviour::grids_and_pixels_agree(make, 1e-5); }
TEST(RayCasting, AFieldLeavesTheRestOut) { radiograph_behaviour::a_field_leaves_the_rest_out(make); }
TEST(RayCasting, SourceWithin) { radiograph_behaviour::source_within(make); }
TEST(RayCasting, RefusesNonsense) { radiograph_behaviour::refuses_nonsense(make); }

}  // namespace ray_casting_test
