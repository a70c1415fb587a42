// SPDX-License-Identifier: Apache-2.0
// An implant has no CT, but its surface is known. Filled with metal it becomes a volume, and every node that draws
// radiographs of a CT draws the implant, too.
#include <tbb/parallel_for.h>

#include <marrow/plugin.hpp>

#include "marrow/toolbox/field/interior.hpp"

namespace {

using marrow::Grid, marrow::Volume;

struct Options {
  double spacing_mm = 0.5;
  double inside_hu = 2000;
};

constexpr double kAirHu = -1000;
constexpr std::size_t kMostVoxels = 100'000'000;

/// The grid around a surface, with a border of two voxels. It lies along the surface's own long axis, so that a long
/// thin implant needs few voxels.
Grid grid_around(const marrow::Mesh& mesh, double spacing) {
  Grid grid;
  grid.frame = mesh.frame;
  grid.spacing_mm.setConstant(spacing);
  grid.direction = marrow::fragment_frame(mesh).axes;
  Eigen::AlignedBox3d box;
  for (const Eigen::Vector3d& vertex : mesh.vertices_mm) box.extend(grid.direction.transpose() * vertex);
  const Eigen::Vector3d low = box.min().array() - 2 * spacing;
  double voxels = 1;
  for (int k = 0; k < 3; ++k) {
    const double size = std::ceil(box.sizes()[k] / spacing) + 5;
    voxels *= size;
    grid.size[std::size_t(k)] = int(std::min(size, 1e6));
  }
  if (voxels > double(kMostVoxels))
    throw marrow::Error(
        marrow::formatted("volume.filled_surface: with spacing_mm {:f} the volume has {:f} million voxels, and at most "
                          "100 are allowed; take a larger spacing_mm",
                          spacing, voxels / 1e6));
  grid.origin_mm = grid.direction * low;
  return grid;
}

/// A voxel that the surface cuts gets the part of it that is metal, estimated from the distance of its centre.
Volume filled_surface(const marrow::Mesh& mesh, const Options& options) {
  marrow::check_mesh(mesh, "volume.filled_surface");
  if (!marrow::is_closed(mesh))
    throw marrow::Error("volume.filled_surface: the surface is open, so it has no inside; close its holes");
  const Grid grid = grid_around(mesh, options.spacing_mm);
  const marrow::SignedField distance = marrow::field::field_of_mesh(grid, mesh, 3 * options.spacing_mm);
  Volume volume{grid, std::vector<float>(grid.count())};
  tbb::parallel_for(std::size_t(0), grid.count(), [&](std::size_t i) {
    const double part = std::clamp(0.5 - double(distance.values_mm[i]) / options.spacing_mm, 0.0, 1.0);
    volume.values[i] = float(kAirHu + part * (options.inside_hu - kAirHu));
  });
  return volume;
}

}  // namespace

MARROW_PLUGIN(plugin) {
  plugin.node("volume.filled_surface", filled_surface)
      .summary("A closed surface filled with one material, as a volume, for radiographs of an implant")
      .in("mesh", "closed surface")
      .out("volume", "inside_hu inside the surface, air outside; voxels that the surface cuts lie between")
      .option("spacing_mm", &Options::spacing_mm, "side of a voxel", marrow::at_least(0.05), marrow::at_most(10))
      .option("inside_hu", &Options::inside_hu, "value inside the surface", marrow::at_least(-999),
              marrow::at_most(30000));
}
