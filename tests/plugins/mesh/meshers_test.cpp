// SPDX-License-Identifier: Apache-2.0
// What every node must do that makes a mesh from a field.
#include "tests/plugins/mesh/shapes.hpp"

namespace marrow::test::meshers_test {

/// A node, and how far its meshes may be off. Volumes are fractions of the true one.
struct Node {
  const char* name;
  double sphere_mm, sphere_volume, torus_volume;
  bool takes_every_field;
};
void PrintTo(const Node& node, std::ostream* stream) { *stream << node.name; }

class Mesher : public testing::TestWithParam<Node> {
 protected:
  static Mesh mesh_of(const SignedField& field, const Options& options = {}) {
    return mesh_shapes::meshed(std::string("mesh.") + GetParam().name, field, options);
  }
  static std::string refusal(const SignedField& field) {
    return shipped::refusal(std::string("mesh.") + GetParam().name, {{"field", item(field)}});
  }
};
INSTANTIATE_TEST_SUITE_P(, Mesher,
                         testing::Values(Node{"delaunay", 0.03, 1e-2, 1.5e-2, false},
                                         Node{"flying_edges", 0.012, 3e-3, 1e-2, true},
                                         Node{"marching_cubes", 0.012, 3e-3, 1e-2, true},
                                         Node{"poisson", 0.05, 2e-3, 5e-3, false},
                                         Node{"surface_nets", 0.05, 5e-3, 1.5e-2, true}),
                         [](const auto& info) { return info.param.name; });

TEST_P(Mesher, SphereInATurnedGrid) {
  const mesh_shapes::Distance distance = [](const Vector3d& p) { return mesh_shapes::sphere(p, 15); };
  const Mesh mesh = mesh_of(mesh_shapes::field_of(mesh_shapes::turned_grid({48, 48, 40}), distance));
  EXPECT_EQ(mesh.frame, "scanner");
  EXPECT_TRUE(is_closed(mesh));
  EXPECT_TRUE(is_manifold(mesh));
  EXPECT_EQ(mesh_shapes::euler_number(mesh), 2);
  EXPECT_LT(mesh_shapes::largest_error_mm(mesh, distance), GetParam().sphere_mm);
  EXPECT_NEAR(enclosed_volume_mm3(mesh) / (4.0 / 3 * kPi * 15 * 15 * 15), 1, GetParam().sphere_volume);
  EXPECT_TRUE(mesh_shapes::normals_point_outward(mesh, distance));
}

TEST_P(Mesher, Torus) {
  const mesh_shapes::Distance distance = [](const Vector3d& p) { return mesh_shapes::torus(p, 12, 5); };
  const Mesh mesh = mesh_of(mesh_shapes::field_of(mesh_shapes::turned_grid({50, 50, 50}), distance));
  EXPECT_TRUE(is_closed(mesh));
  EXPECT_TRUE(is_manifold(mesh));
  EXPECT_EQ(mesh_shapes::euler_number(mesh), 0);
  EXPECT_NEAR(enclosed_volume_mm3(mesh) / (2 * kPi * kPi * 12 * 25), 1, GetParam().torus_volume);
}

TEST_P(Mesher, EveryPatternIsAClosedManifold) {
  if (!GetParam().takes_every_field) return;
  for (const bool around : {false, true})
    for (unsigned inside = 0; inside < 256; ++inside) {
      if (inside == (around ? 255u : 0u)) continue;  // no surface
      const Mesh mesh = mesh_of(mesh_shapes::pattern_field(inside, around), {{"largest_only", false}});
      EXPECT_TRUE(is_manifold(mesh)) << "pattern " << inside << (around ? " in the inside" : "");
      EXPECT_GT(enclosed_volume_mm3(mesh), 0);
    }
}

TEST_P(Mesher, SaysWhatIsWrongWithAField) {
  EXPECT_EQ(refusal({}), "field: 0 values do not fill a grid of 0 x 0 x 0 voxels; wire the output of a segment node");
  SignedField field;
  field.grid.size = {3, 3, 3};
  field.values_mm.assign(27, 2.f);
  EXPECT_EQ(refusal(field),
            "field: there is no surface, as no value is negative (inside); the segmentation found nothing: check its "
            "seeds and thresholds");
  field.values_mm.assign(27, -2.f);
  EXPECT_EQ(refusal(field),
            "field: there is no surface, as every value is negative (inside); the segmentation ran over the whole "
            "volume: raise its threshold");
  for (const float value : {std::nanf(""), -INFINITY}) {
    field.values_mm[13] = value;
    EXPECT_EQ(refusal(field), "field: some values are not finite numbers; a signed distance in mm was expected");
  }
}

}  // namespace marrow::test::meshers_test
