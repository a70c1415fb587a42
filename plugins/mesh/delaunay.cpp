// SPDX-License-Identifier: GPL-3.0-or-later
// This file is under the GPL because it is linked to the surface mesher of CGAL (delaunay_refinement.cpp).
#include <marrow/plugin.hpp>

#include "delaunay_refinement.hpp"
#include "marrow/mesh/surface.hpp"

namespace {

using Eigen::Vector3d;
using marrow::Grid, marrow::Mesh, marrow::SignedField;

struct Options : marrow::surface::Finish {
  double min_angle_deg = 30, max_radius_mm = 2, max_distance_mm = 0.05;
};

/// Trilinear interpolation of the field with one layer of padding around its grid. Everything beyond this layer is
/// outside.
class Interpolated {
 public:
  explicit Interpolated(const SignedField& field) : padded_(field), size_(field.grid.size) {}

  double operator()(const Vector3d& index) const {
    int first[3];
    double part[3];
    for (int axis = 0; axis < 3; ++axis) {
      if (!(index[axis] > -1 && index[axis] < size_[std::size_t(axis)])) return kOutside;
      first[axis] = int(std::floor(index[axis]));
      part[axis] = index[axis] - first[axis];
    }
    double sum = 0;
    for (int c = 0; c < 8; ++c) {
      double weight = 1;
      for (int axis = 0; axis < 3; ++axis) weight *= c >> axis & 1 ? part[axis] : 1 - part[axis];
      sum += weight * padded_(first[0] + (c & 1), first[1] + (c >> 1 & 1), first[2] + (c >> 2));
    }
    return sum < 0 ? sum : std::max(sum, kLeast);
  }

 private:
  static constexpr double kOutside = 1, kLeast = 1e-12;
  marrow::surface::Padded padded_;
  std::array<int, 3> size_;
};

/// Some points of the surface: one in each block of samples. So there are points on each connected part.
std::vector<Vector3d> spread_points(const marrow::surface::Signs& signs, int block) {
  std::array<std::size_t, 3> blocks;
  for (std::size_t axis = 0; axis < 3; ++axis) blocks[axis] = std::size_t(signs.size()[axis] / block + 1);
  std::vector<bool> taken(blocks[0] * blocks[1] * blocks[2], false);
  std::vector<Vector3d> points;
  signs.for_edges([&](int axis, int x, int y, int z) {
    auto place =
        taken[(std::size_t(z / block) * blocks[1] + std::size_t(y / block)) * blocks[0] + std::size_t(x / block)];
    if (place) return;
    place = true;
    points.push_back(signs.crossing(axis, x, y, z));
  });
  return points;
}

/// Upper limit for the number of vertices. Many more vertices than marching cubes would make show no more detail of the
/// field, unless the triangles must be smaller than its cells.
std::size_t most_points(const marrow::surface::Signs& signs, const Grid& grid, const Options& options) {
  double crossings = 0;
  signs.for_edges([&](int, int, int, int) { ++crossings; });
  const double smallest_mm = std::min(options.max_radius_mm, 4 * options.max_distance_mm);
  return std::size_t(1000 + 8 * crossings * std::max(1.0, std::pow(grid.spacing_mm.minCoeff() / smallest_mm, 2)));
}

Mesh delaunay(const SignedField& field, const Options& options, marrow::Context& context) {
  const Grid& grid = field.grid;
  const marrow::surface::Signs signs(field);
  const Interpolated interpolated(field);
  // CGAL works in mm, along the axes of the grid, with the origin at the middle of the grid.
  const Vector3d middle = (Vector3d(grid.size[0], grid.size[1], grid.size[2]) - Vector3d::Ones()) / 2;
  marrow::delaunay::LevelSet level_set;
  level_set.value = [&](const Vector3d& p) { return interpolated(p.cwiseQuotient(grid.spacing_mm) + middle); };
  level_set.radius_mm = 1.1 * (middle + Vector3d::Constant(2)).cwiseProduct(grid.spacing_mm).norm();
  const marrow::delaunay::Criteria criteria{options.min_angle_deg, options.max_radius_mm, options.max_distance_mm,
                                            most_points(signs, grid, options)};
  std::string fault;
  // First, the points are about as far apart as the size of the triangles. Smaller parts of the surface need more
  // points.
  const int largest_block = std::clamp(int(2 * options.max_radius_mm / grid.spacing_mm.minCoeff()), 4, 16);
  for (int block = largest_block; block > 0; block /= 2) {
    level_set.points_mm.clear();
    for (const Vector3d& index : spread_points(signs, block))
      level_set.points_mm.push_back((index - middle).cwiseProduct(grid.spacing_mm));
    try {
      marrow::delaunay::Surface surface =
          marrow::delaunay::mesh(level_set, criteria, [&] { context.check_cancelled(); });
      Mesh mesh;
      mesh.frame = grid.frame;
      for (const Vector3d& p : surface.vertices_mm)
        mesh.vertices_mm.push_back(grid.point_from_index(p.cwiseQuotient(grid.spacing_mm) + middle));
      mesh.triangles = std::move(surface.triangles);
      mesh = marrow::surface::finish(std::move(mesh), options);
      if (surface.complete && marrow::is_manifold(mesh)) return mesh;
      fault = surface.complete ? "its parts are smaller than the triangles"
                               : marrow::formatted("it stopped at {} vertices", criteria.most_points);
    } catch (const std::logic_error&) {  // a condition that CGAL asserts
      fault = "CGAL's mesher came to a degenerate case";
    }
  }
  throw marrow::Error("field: Delaunay refinement does not close its surface: " + fault +
                      "; smooth the field, change max_radius_mm and max_distance_mm, or use mesh.marching_cubes, which "
                      "takes every field");
}

}  // namespace

MARROW_PLUGIN(plugin) {
  plugin.node("mesh.delaunay", delaunay)
      .summary(
          "Delaunay refinement (Boissonnat and Oudot, Graphical Models 2005; by CGAL, so under the GPL): makes "
          "triangles of even size")
      .in("field", "signed distance, negative inside")
      .out("mesh", "closed surface of the field's zero level, normals outward")
      .option("min_angle_deg", &Options::min_angle_deg, "smallest allowed angle of a triangle, before smoothing",
              marrow::at_least(0), marrow::at_most(30))
      .option("max_radius_mm", &Options::max_radius_mm,
              "largest allowed radius of the circle through a triangle's corners", marrow::at_least(0.01))
      .option("max_distance_mm", &Options::max_distance_mm,
              "largest allowed distance from a triangle's middle to the surface", marrow::at_least(0.001))
      .option("largest_only", &Options::largest_only, marrow::surface::kLargestOnlyHelp)
      .option("smoothing", &Options::smoothing, marrow::surface::kSmoothingHelp, marrow::at_least(0),
              marrow::at_most(200));
}
