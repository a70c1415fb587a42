// SPDX-License-Identifier: Apache-2.0
#include "tests/plugins/project/made.hpp"
#include "tests/plugins/project/outline_behaviour.hpp"

namespace silhouette_test {

std::shared_ptr<const marrow::OutlineProjector> make(const marrow::Mesh& mesh, const marrow::Volume* volume) {
  return made::outlines("project.silhouette", mesh, volume);
}

TEST(Silhouette, SphereIsItsTangentCone) { outline_behaviour::sphere_is_its_tangent_cone(make, 0.8, 4); }
TEST(Silhouette, HiddenPartsAreLeftOut) { outline_behaviour::hidden_parts_are_left_out(make); }
TEST(Silhouette, EndsOfTheVolumeAreLeftOut) { outline_behaviour::ends_of_the_volume_are_left_out(make); }
TEST(Silhouette, KeepsInsideTheImage) { outline_behaviour::keeps_inside_the_image(make); }
TEST(Silhouette, RefusesNonsense) { outline_behaviour::refuses_nonsense(make); }

}  // namespace silhouette_test
