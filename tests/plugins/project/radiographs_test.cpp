// SPDX-License-Identifier: Apache-2.0
// The projectors that follow rays through the voxels.
#include "tests/plugins/project/made.hpp"
#include "tests/plugins/project/radiograph_behaviour.hpp"

namespace marrow::test::radiographs_test {

/// A node, and how far its radiographs may be off.
struct Node {
  const char* name;
  double cloud_mean_mm, cloud_worst_mm, smoothed_cloud_mm, grids_mm;
};
void PrintTo(const Node& node, std::ostream* stream) { *stream << node.name; }

class Radiographs : public testing::TestWithParam<Node> {
 protected:
  const radiograph_behaviour::Make make = [](const Volume& volume, const SignedField* field) {
    return made::radiographs(std::string("project.") + GetParam().name, volume, field);
  };
};
INSTANTIATE_TEST_SUITE_P(, Radiographs,
                         testing::Values(Node{"joseph", 0.03, 0.2, 0.25, 0.2},
                                         Node{"ray_casting", 0.03, 0.2, 0.25, 1e-5},
                                         Node{"siddon_jacobs", 0.07, 2, 1.2, 1e-5}),
                         [](const auto& info) { return info.param.name; });

TEST_P(Radiographs, IntegralsOfACloud) {
  radiograph_behaviour::integrals_of_a_cloud(make, GetParam().cloud_mean_mm, GetParam().cloud_worst_mm);
}
TEST_P(Radiographs, ChordOfABlock) { radiograph_behaviour::chord_of_a_block(make); }
TEST_P(Radiographs, SmoothedCloud) { radiograph_behaviour::smoothed_cloud(make, GetParam().smoothed_cloud_mm); }
TEST_P(Radiographs, RegionHoldsAll) { radiograph_behaviour::region_holds_all(make); }
TEST_P(Radiographs, GridsAndPixelsAgree) { radiograph_behaviour::grids_and_pixels_agree(make, GetParam().grids_mm); }
TEST_P(Radiographs, AFieldLeavesTheRestOut) { radiograph_behaviour::a_field_leaves_the_rest_out(make); }
TEST_P(Radiographs, SourceWithin) { radiograph_behaviour::source_within(make); }
TEST_P(Radiographs, RefusesNonsense) { radiograph_behaviour::refuses_nonsense(make); }

}  // namespace marrow::test::radiographs_test
