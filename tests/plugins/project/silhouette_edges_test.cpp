// SPDX-License-Identifier: Apache-2.0
#include "tests/plugins/project/made.hpp"
#include "tests/plugins/project/outline_behaviour.hpp"

namespace silhouette_edges_test {

std::shared_ptr<const marrow::OutlineProjector> make(const marrow::Mesh& mesh, const marrow::Volume* volume) {
  return made::outlines("project.silhouette_edges", mesh, volume);
}

TEST(SilhouetteEdges, SphereIsItsTangentCone) { outline_behaviour::sphere_is_its_tangent_cone(make, 0.02, 0.01); }
TEST(SilhouetteEdges, HiddenPartsAreLeftOut) { outline_behaviour::hidden_parts_are_left_out(make); }
TEST(SilhouetteEdges, EndsOfTheVolumeAreLeftOut) { outline_behaviour::ends_of_the_volume_are_left_out(make); }
TEST(SilhouetteEdges, KeepsInsideTheImage) { outline_behaviour::keeps_inside_the_image(make); }
TEST(SilhouetteEdges, RefusesNonsense) { outline_behaviour::refuses_nonsense(make); }

TEST(SilhouetteEdges, OpenSurfaceGivesItsSidesOnly) {
  marrow::Mesh mesh = shapes::cylinder(14, 100);
  mesh.triangles.resize(mesh.triangles.size() - 400);  // both lids gone
  const auto points = make(mesh, nullptr)->outline(shapes::c_arm(0), shapes::centred_at({0, 0, 50}), 1);
  EXPECT_GT(points.size(), 400u);
  for (const auto& p : points) EXPECT_GT(std::abs(p.normal_u), 0.9);
}

TEST(SilhouetteEdges, RepeatedVerticesAreWelded) {
  const marrow::Mesh mesh = shapes::sphere(30);
  marrow::Mesh soup;
  for (const auto& t : mesh.triangles) {
    const auto first = std::uint32_t(soup.vertices_mm.size());
    for (const auto corner : t) soup.vertices_mm.push_back(mesh.vertices_mm[corner]);
    soup.triangles.push_back({first, first + 1, first + 2});
  }
  const auto pose = shapes::centred_at({0, 0, 30});
  const auto a = make(mesh, nullptr)->outline(shapes::c_arm(0), pose, 4);
  const auto b = make(soup, nullptr)->outline(shapes::c_arm(0), pose, 4);
  ASSERT_EQ(a.size(), b.size());
  for (std::size_t i = 0; i < a.size(); ++i) EXPECT_NEAR(a[i].u_px, b[i].u_px, 1e-3);
}

TEST(SilhouetteEdges, AgreesWithItselfOnAGridTwiceAsCoarse) {
  const marrow::Mesh mesh = shapes::distal_femur();
  const auto pose = shapes::centred_at({0, 0, 90});
  const auto projector = make(mesh, nullptr);
  const auto fine = projector->outline(shapes::c_arm(90), pose, 1),
             coarse = projector->outline(shapes::c_arm(90), pose, 2);
  EXPECT_NEAR(double(fine.size()), 2.0 * double(coarse.size()), 0.03 * double(fine.size()));
}

}  // namespace silhouette_edges_test
