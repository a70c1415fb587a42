// SPDX-License-Identifier: Apache-2.0
#include "marrow/mesh/cells.hpp"
#include "tests/plugins/mesh/shapes.hpp"

namespace marrow::test::meshers_test {

using namespace mesh_shapes;

// What every node must do that makes a mesh from a field.

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
    return meshed(std::string("mesh.") + GetParam().name, field, options);
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
  const Distance distance = [](const Vector3d& p) { return sphere(p, 15); };
  const Mesh mesh = mesh_of(field_by(turned_grid({48, 48, 40}), distance));
  EXPECT_EQ(mesh.frame, "scanner");
  EXPECT_TRUE(is_closed(mesh));
  EXPECT_TRUE(is_manifold(mesh));
  EXPECT_EQ(euler_number(mesh), 2);
  EXPECT_LT(largest_error_mm(mesh, distance), GetParam().sphere_mm);
  EXPECT_NEAR(enclosed_volume_mm3(mesh) / (4.0 / 3 * kPi * 15 * 15 * 15), 1, GetParam().sphere_volume);
  EXPECT_TRUE(normals_point_outward(mesh, distance));
}

TEST_P(Mesher, Torus) {
  const Distance distance = [](const Vector3d& p) { return torus(p, 12, 5); };
  const Mesh mesh = mesh_of(field_by(turned_grid({50, 50, 50}), distance));
  EXPECT_TRUE(is_closed(mesh));
  EXPECT_TRUE(is_manifold(mesh));
  EXPECT_EQ(euler_number(mesh), 0);
  EXPECT_NEAR(enclosed_volume_mm3(mesh) / (2 * kPi * kPi * 12 * 25), 1, GetParam().torus_volume);
}

TEST_P(Mesher, EveryPatternIsAClosedManifold) {
  if (!GetParam().takes_every_field) return;
  for (const bool around : {false, true})
    for (unsigned inside = 0; inside < 256; ++inside) {
      if (inside == (around ? 255u : 0u)) continue;  // no surface
      const Mesh mesh = mesh_of(pattern_field(inside, around), {{"largest_only", false}});
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

Mesh marching_cubes(const SignedField& field, const Options& options = {}) {
  return meshed("mesh.marching_cubes", field, options);
}

TEST(CellTable, EveryPatternUsesExactlyTheEdgesThatTheSurfaceCrosses) {
  for (unsigned inside = 0; inside < 256; ++inside) {
    unsigned expected = 0, used = 0;
    for (int edge = 0; edge < 12; ++edge) {
      const int start = surface::kEdgeStart[edge], end = start | 1 << edge / 4;
      if ((inside >> start & 1) != (inside >> end & 1)) expected |= 1u << edge;
    }
    for (const auto& triangle : surface::cell_triangles(inside))
      for (int edge : triangle) used |= 1u << edge;
    EXPECT_EQ(used, expected) << "pattern " << inside;
  }
}

TEST(MarchingCubes, NoiseIsAClosedManifold) {
  for (unsigned seed = 0; seed < 40; ++seed) {
    const auto field = noise_field({17, 14, 13}, seed, 0.2 + 0.015 * seed);
    EXPECT_TRUE(is_manifold(marching_cubes(field, {{"largest_only", false}}))) << "seed " << seed;
    EXPECT_TRUE(is_manifold(marching_cubes(field))) << "seed " << seed;
  }
  for (const int width :
       {1, 62, 63, 64, 126, 127, 150})  // rows that end in the middle of a word of signs and at its ends
    EXPECT_TRUE(is_manifold(marching_cubes(noise_field({width, 9, 9}, 1), {{"largest_only", false}}))) << width;
}

TEST(MarchingCubes, AreaOfSphereAndTorus) {
  const auto area_mm2 = [](const Distance& distance) {
    return surface_area_mm2(marching_cubes(field_by(turned_grid({50, 50, 50}), distance)));
  };
  EXPECT_NEAR(area_mm2([](const Vector3d& p) { return sphere(p, 15); }) / (4 * kPi * 15 * 15), 1, 2e-3);
  EXPECT_NEAR(area_mm2([](const Vector3d& p) { return torus(p, 12, 5); }) / (4 * kPi * kPi * 12 * 5), 1, 5e-3);
}

TEST(MarchingCubes, Ellipsoid) {
  const Distance level = [](const Vector3d& p) {  // not a distance: 1 at twice the radius, whatever the axis
    return p.cwiseQuotient(Vector3d(18, 12, 9)).norm() - 1;
  };
  const Mesh mesh = marching_cubes(field_by(turned_grid({60, 60, 60}), level));
  EXPECT_TRUE(is_closed(mesh));
  EXPECT_EQ(euler_number(mesh), 2);
  EXPECT_NEAR(enclosed_volume_mm3(mesh) / (4.0 / 3 * kPi * 18 * 12 * 9), 1, 4e-3);
  EXPECT_TRUE(normals_point_outward(mesh, level));
}

TEST(CubeMeshers, CloseHalfAVoxelBeyondTheBorder) {
  for (const std::string node : {"mesh.marching_cubes", "mesh.flying_edges"}) {
    const Mesh mesh = meshed(node, cut_cylinder());
    EXPECT_TRUE(is_closed(mesh)) << node;
    EXPECT_NEAR(extent(mesh).min().z(), -1, 1e-9) << node;
    EXPECT_NEAR(extent(mesh).max().z(), 21, 1e-9) << node;
    EXPECT_NEAR(enclosed_volume_mm3(mesh) / (kPi * 100 * 22), 1, 8e-3) << node;
  }
}

TEST(CubeMeshers, KeepTheLargestPartAndDropItsInnerWall) {
  for (const std::string node : {"mesh.marching_cubes", "mesh.flying_edges"}) {
    const Mesh all = meshed(node, shell_and_speck(), {{"largest_only", false}}),
               largest = meshed(node, shell_and_speck());
    EXPECT_TRUE(is_closed(all)) << node;
    EXPECT_EQ(euler_number(all), 6) << "outer wall, inner wall, speck; " << node;
    EXPECT_EQ(euler_number(largest), 2) << node;
    EXPECT_NEAR(enclosed_volume_mm3(largest) / (4.0 / 3 * kPi * 14 * 14 * 14), 1, 3e-3) << node;
  }
}

TEST(MarchingCubes, ZeroesOnGridPointsLeaveNoDegenerateTriangle) {
  SignedField field;
  field.grid.size = {9, 9, 9};
  for (int z = -4; z <= 4; ++z)
    for (int y = -4; y <= 4; ++y)
      for (int x = -4; x <= 4; ++x) field.values_mm.push_back(float(std::abs(x) + std::abs(y) + std::abs(z) - 3));
  const Mesh mesh = marching_cubes(field);
  EXPECT_TRUE(is_closed(mesh));
  for (const auto& t : mesh.triangles) {
    const Vector3d a = mesh.vertices_mm[t[0]], b = mesh.vertices_mm[t[1]], c = mesh.vertices_mm[t[2]];
    EXPECT_GT((b - a).cross(c - a).norm(), 0);
  }
  EXPECT_NEAR(enclosed_volume_mm3(mesh), 4.0 / 3 * 27, 0.02);
}

TEST(MarchingCubes, SmoothingTakesNoiseAndKeepsTheVolume) {
  const Distance distance = [](const Vector3d& p) { return sphere(p, 15); };
  SignedField field = field_by(turned_grid({48, 48, 40}), distance);
  const auto noise = noise_field(field.grid.size, 3);
  for (std::size_t i = 0; i < noise.values_mm.size(); ++i) field.values_mm[i] += 0.2f * noise.values_mm[i];
  const auto rms_mm = [&](const Mesh& mesh) {
    double sum = 0;
    for (const auto& v : mesh.vertices_mm) sum += distance(v) * distance(v);
    return std::sqrt(sum / double(mesh.vertices_mm.size()));
  };
  const Mesh rough = marching_cubes(field), smooth = marching_cubes(field, {{"smoothing", 10}});
  EXPECT_LT(rms_mm(smooth), 0.6 * rms_mm(rough));
  EXPECT_NEAR(enclosed_volume_mm3(smooth) / enclosed_volume_mm3(rough), 1, 2e-3);
}

Mesh nets(const SignedField& field, bool largest_only = true, int relaxation = 0) {
  return meshed("mesh.surface_nets", field, {{"largest_only", largest_only}, {"relaxation", relaxation}});
}

TEST(SurfaceNets, NoiseIsAClosedManifold) {
  for (unsigned seed = 0; seed < 40; ++seed) {
    const auto field = noise_field({17, 14, 13}, seed, 0.2 + 0.015 * seed);
    EXPECT_TRUE(is_manifold(nets(field, false))) << "seed " << seed;
    EXPECT_TRUE(is_manifold(nets(field, false, 3))) << "seed " << seed;
  }
}

/// Two samples are outside, on the diagonal of a face; all others are inside. Both cells at the face have one loop,
/// which crosses the face twice.
TEST(SurfaceNets, AFaceThatIsCrossedTwiceByTheSameTwoLoopsIsSplit) {
  SignedField field;
  field.grid.size = {5, 5, 5};
  field.values_mm.assign(125, -1);
  field.values_mm[field.grid.offset(2, 2, 2)] = field.values_mm[field.grid.offset(3, 3, 2)] = 1;
  const Mesh mesh = nets(field, false);
  EXPECT_TRUE(is_manifold(mesh));
  int split = 0;
  for (const auto& v : mesh.vertices_mm) split += (v - Vector3d(2.5, 2.5, 2)).head<2>().norm() < 0.4 && v.z() == 2;
  EXPECT_EQ(split, 2) << "one vertex for each crossing of the face";
}

TEST(SurfaceNets, KeepsApartWhatOneSampleParts) {
  const auto field = field_by(turned_grid({48, 48, 40}), [](const Vector3d& p) { return two_slabs(p, 1.5); });
  EXPECT_EQ(euler_number(nets(field, false)), 4);
}

/// A field of signs alone has steps as high as a sample.
TEST(SurfaceNets, RelaxationTakesTheStepsOfABinaryField) {
  const Distance distance = [](const Vector3d& p) { return sphere(p, 22); };
  SignedField field = field_by(turned_grid({62, 62, 50}), distance);
  for (float& value : field.values_mm) value = value < 0 ? -0.5f : 0.5f;
  const auto roughness = [&](const Mesh& mesh) {  // sine between the triangles' normals and the sphere's
    double sum = 0;
    for (const auto& t : mesh.triangles) {
      const Vector3d a = mesh.vertices_mm[t[0]], b = mesh.vertices_mm[t[1]], c = mesh.vertices_mm[t[2]];
      sum += (b - a).cross(c - a).normalized().cross((a + b + c).normalized()).squaredNorm();
    }
    return std::sqrt(sum / double(mesh.triangles.size()));
  };
  const Mesh rough = nets(field), relaxed = nets(field, true, 5);
  EXPECT_LT(roughness(relaxed), 0.5 * roughness(rough));
  EXPECT_TRUE(is_manifold(relaxed));
  EXPECT_NEAR(enclosed_volume_mm3(relaxed) / (4.0 / 3 * kPi * 22 * 22 * 22), 1, 0.02);
  const Mesh long_relaxed = nets(field, true, 100);
  ASSERT_EQ(long_relaxed.vertices_mm.size(), rough.vertices_mm.size());
  for (std::size_t v = 0; v < rough.vertices_mm.size(); ++v) {  // both lie in the same cell, a sample wide
    const Vector3d moved =
        field.grid.index_from_point(long_relaxed.vertices_mm[v]) - field.grid.index_from_point(rough.vertices_mm[v]);
    EXPECT_LE(moved.cwiseAbs().maxCoeff(), 1 + 1e-9);
  }
}

}  // namespace marrow::test::meshers_test
