// SPDX-License-Identifier: GPL-3.0-or-later
// Linked to CGAL's surface mesher, as the node mesh.delaunay is.
#include <set>

#include "marrow/mesh/surface.hpp"
#include "plugins/mesh/delaunay_refinement.hpp"
#include "tests/plugins/mesh/shapes.hpp"

namespace marrow::test::delaunay_refinement_test {

/// A field as a level set around its middle, with a spacing of 1 mm. It is trilinear; beyond one layer around the grid
/// all is outside.
delaunay::LevelSet level_set_of(const SignedField& field, const Vector3d& middle) {
  delaunay::LevelSet level_set;
  const surface::Padded padded(field);
  level_set.value = [padded, middle, size = field.grid.size](const Vector3d& p) -> double {
    const Vector3d index = p + middle, first = index.array().floor().matrix(), part = index - first;
    for (int axis = 0; axis < 3; ++axis)
      if (!(index[axis] > -1 && index[axis] < size[std::size_t(axis)])) return 1;
    double sum = 0;
    for (int c = 0; c < 8; ++c) {
      const Eigen::Array3i side(c & 1, c >> 1 & 1, c >> 2), at = first.array().cast<int>() + side;
      sum += (side == 1).select(part.array(), 1 - part.array()).prod() * padded(at.x(), at.y(), at.z());
    }
    return sum < 0 ? sum : std::max(sum, 1e-12);
  };
  const surface::Signs signs(field);
  std::set<std::array<int, 3>> blocks;  // of two samples; a point in each
  signs.for_edges([&](int axis, int x, int y, int z) {
    if (blocks.insert({x / 2, y / 2, z / 2}).second)
      level_set.points_mm.push_back(signs.crossing(axis, x, y, z) - middle);
  });
  return level_set;
}

TEST(Delaunay, StopsWhereTheFieldIsTooRoughForWhatIsAsked) {
  const auto field = mesh_shapes::noise_field({9, 8, 10}, 3, 0.4);
  delaunay::LevelSet level_set = level_set_of(field, Vector3d(4, 3.5, 4.5));
  level_set.radius_mm = 12;
  const auto surface = delaunay::mesh(level_set, {30, 0.05, 0.01, 3000}, [] {});
  EXPECT_FALSE(surface.complete);
  EXPECT_LT(surface.vertices_mm.size(), 5000u);
}

}  // namespace marrow::test::delaunay_refinement_test
