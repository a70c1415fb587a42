// SPDX-License-Identifier: Apache-2.0
#include <marrow/plugin.hpp>

#include "marrow/mesh/surface.hpp"
#include "poisson_surface.hpp"

namespace {

using Eigen::Vector3d;
using marrow::Grid, marrow::Mesh, marrow::SignedField;

struct Options : marrow::surface::Finish {
  int depth = 0;
  double point_weight = 4;
};

constexpr int kLeastDepth = 5, kMostDepth = 11;

std::array<float, 3> to_array(const Vector3d& v) { return {float(v.x()), float(v.y()), float(v.z())}; }

/// The points where the field changes its sign along the edges of its grid, with the gradient's direction. In mm, along
/// the axes of the grid, with the origin at its middle.
std::vector<marrow::surface::OrientedPoint> sample(const SignedField& field, const Vector3d& middle) {
  const marrow::surface::Signs signs(field);
  const marrow::surface::Padded padded(field);
  const Vector3d& spacing = field.grid.spacing_mm;
  const auto gradient = [&](int x, int y, int z) {
    return Vector3d((padded(x + 1, y, z) - padded(x - 1, y, z)) / spacing.x(),
                    (padded(x, y + 1, z) - padded(x, y - 1, z)) / spacing.y(),
                    (padded(x, y, z + 1) - padded(x, y, z - 1)) / spacing.z());
  };
  std::vector<marrow::surface::OrientedPoint> points;
  signs.for_edges([&](int axis, int x, int y, int z) {
    const Vector3d index = signs.crossing(axis, x, y, z);
    const int from[3] = {x - 1, y - 1, z - 1};
    const double part = index[axis] - from[axis];
    Vector3d normal = (1 - part) * gradient(from[0], from[1], from[2]) +
                      part * gradient(from[0] + (axis == 0), from[1] + (axis == 1), from[2] + (axis == 2));
    if (!(normal.norm() > 0)) {
      normal = Vector3d::Unit(axis);
      if (padded(from[0], from[1], from[2]) >= 0) normal = -normal;
    }
    points.push_back({to_array((index - middle).cwiseProduct(spacing)), to_array(normal.normalized())});
  });
  return points;
}

/// The cube in which PCL reconstructs must be larger than the box of the points. Otherwise it cuts off parts where the
/// surface bulges out. The depth of the octree is chosen so that its smallest cells are about as large as the voxels.
marrow::surface::Settings settings_for(const std::vector<marrow::surface::OrientedPoint>& points, double cell_mm,
                                       const Options& options) {
  double extent_mm = 0;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const auto [low, high] = std::minmax_element(points.begin(), points.end(),
                                                 [axis](auto& a, auto& b) { return a.place[axis] < b.place[axis]; });
    extent_mm = std::max(extent_mm, double(high->place[axis] - low->place[axis]));
  }
  const double side_mm = 1.1 * extent_mm + 4 * cell_mm;
  const int depth = std::clamp(int(std::lround(std::log2(side_mm / cell_mm))), kLeastDepth, kMostDepth);
  return {options.depth > 0 ? options.depth : depth, float(side_mm / extent_mm), float(options.point_weight)};
}

Mesh poisson(const SignedField& field, const Options& options) {
  const Grid& grid = field.grid;
  marrow::surface::check_grid(field);
  const Vector3d middle = (Vector3d(grid.size[0], grid.size[1], grid.size[2]) - Vector3d::Ones()) / 2;
  const std::vector<marrow::surface::OrientedPoint> points = sample(field, middle);
  const marrow::surface::Settings settings = settings_for(points, grid.spacing_mm.minCoeff(), options);
  marrow::surface::Surface surface;
  try {
    surface = marrow::surface::reconstruct(points, settings);
  } catch (const std::exception& error) {
    throw marrow::Error(std::string("field: PCL's Poisson reconstruction gave up (") + error.what() +
                        "); use mesh.marching_cubes, which takes every field");
  }
  Mesh mesh;
  mesh.frame = grid.frame;
  for (const auto& [x, y, z] : surface.vertices)
    mesh.vertices_mm.push_back(grid.point_from_index(Vector3d(x, y, z).cwiseQuotient(grid.spacing_mm) + middle));
  mesh.triangles = std::move(surface.triangles);
  const bool finite =
      std::all_of(mesh.vertices_mm.begin(), mesh.vertices_mm.end(), [](const Vector3d& p) { return p.allFinite(); });
  if (finite) mesh = marrow::surface::finish(std::move(mesh), options);
  if (!finite || !marrow::is_manifold(mesh))
    throw marrow::Error(
        "field: the surface that fits its points is not closed, as Poisson reconstruction needs a smooth surface; "
        "smooth the field, or use mesh.marching_cubes, which takes every field");
  return mesh;
}

}  // namespace

MARROW_PLUGIN(plugin) {
  plugin.node("mesh.poisson", poisson)
      .summary(
          "Poisson reconstruction (Kazhdan and Hoppe, ACM Transactions on Graphics 2013; by PCL): makes smooth "
          "surfaces")
      .in("field", "signed distance, negative inside")
      .out("mesh", "closed surface of the field's zero level, normals outward")
      .option("depth", &Options::depth,
              "depth of the octree; it has at most 2^depth cells per side; 0: cells about as large as the voxels",
              marrow::at_least(0), marrow::at_most(kMostDepth))
      .option(
          "point_weight", &Options::point_weight,
          "weight of the positions where the field is zero, against the directions of its gradient; 0: directions only",
          marrow::at_least(0))
      .option("largest_only", &Options::largest_only, marrow::surface::kLargestOnlyHelp)
      .option("smoothing", &Options::smoothing, marrow::surface::kSmoothingHelp, marrow::at_least(0),
              marrow::at_most(200));
}
