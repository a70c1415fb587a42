// SPDX-License-Identifier: Apache-2.0
// A bone from surfaces, for example the outer and the endosteal surface of a real femur in files.
#include <marrow/plugin.hpp>

#include "marrow/simulate/polygonise.hpp"
#include "marrow/simulate/vectors.hpp"
#include "marrow/toolbox/exchange/surface_file.hpp"
#include "marrow/toolbox/field/interior.hpp"
#include "marrow/toolbox/phantom/phantom.hpp"

namespace {

using namespace marrow;
using phantom::Bone;

struct SurfaceOptions {
  std::filesystem::path outer;
  std::filesystem::path inner;
  double scale = 1;
  std::array<double, 3> rotation_deg{0, 0, 0};
  std::vector<double> fill_at{0, 0.06, 0.16, 0.24, 0.74, 0.84, 1}, fill_fraction{0.30, 0.24, 0.15, 0, 0, 0.16, 0.30};
  std::vector<double> cortex_mm;
  bool long_bone = true;
  double isocentre_from_distal_end_mm = 70;
  double thigh_radius_mm = 80;
  double fat_mm = 12;
};

Mesh placed(Mesh mesh, const SurfaceOptions& options) {
  const auto about = [&](std::size_t k, const Eigen::Vector3d& axis) {
    return Eigen::AngleAxisd(radians(options.rotation_deg[k]), axis).toRotationMatrix();
  };
  const Eigen::Matrix3d rotation =
      about(2, Eigen::Vector3d::UnitZ()) * about(1, Eigen::Vector3d::UnitY()) * about(0, Eigen::Vector3d::UnitX());
  for (auto& vertex : mesh.vertices_mm) vertex = (rotation * vertex).eval();
  mesh.frame = "bone";
  return mesh;
}

/// The surface inside the outer one at the thickness of the cortex, which is given at heights z.
Mesh endosteum(const Mesh& outer, const Eigen::Vector3d& low, const Eigen::Vector3d& high,
               const std::vector<phantom::Node>& cortex_mm) {
  constexpr double kSpacingMm = 1;
  double thickest = 0;
  for (const auto& [z, thickness] : cortex_mm) thickest = std::max(thickest, thickness);
  Grid grid;
  grid.frame = outer.frame;
  grid.origin_mm = low.array() - 3 * kSpacingMm;
  for (int k = 0; k < 3; ++k) grid.size[std::size_t(k)] = int((high[k] - low[k]) / kSpacingMm) + 8;
  const SignedField distance = field::field_of_mesh(grid, outer, thickest + 4 * kSpacingMm);
  const auto inside = [&](const Eigen::Vector3d& p) {
    return double(sample_trilinear(grid, distance.values_mm, grid.index_from_point(p))) +
           phantom::along(cortex_mm, p.z());
  };
  Mesh inner = phantom::polygonise(inside, low.array() - 2 * kSpacingMm, high.array() + 2 * kSpacingMm, kSpacingMm, 5);
  if (inner.triangles.empty())
    throw Error("simulate.surface: the bone is nowhere thicker than twice its cortex; give a smaller cortex_mm");
  inner.frame = outer.frame;
  return inner;
}

Bone surface(const Mesh* outer, const SurfaceOptions& options, Context& context) {
  const auto read = [&](const std::filesystem::path& path) {
    return placed(exchange::read_surface_file(path, options.scale, context), options);
  };
  Bone bone;
  bone.outer = outer ? placed(*outer, options) : read(options.outer);
  if (!options.inner.empty()) bone.inner = read(options.inner);
  const Eigen::AlignedBox3d box = phantom::bounds_of(bone.outer.vertices_mm);
  const Eigen::Vector3d low = box.min(), extent = box.sizes();
  if (options.long_bone && extent.z() < std::max(extent.x(), extent.y()))
    throw Error(
        formatted("simulate.surface: the bone's long axis must lie along z with the distal end low, but it extends "
                  "{:f} x {:f} x {:f} mm; turn it with rotation_deg",
                  extent.x(), extent.y(), extent.z()));
  if (!options.cortex_mm.empty()) {
    if (!options.inner.empty())
      throw Error("simulate.surface: the inner surface is given by a file and by cortex_mm; give one of them");
    phantom::check_bone(bone, "simulate.surface");
    std::vector<phantom::Node> cortex_mm;
    for (std::size_t i = 0; i < options.cortex_mm.size(); ++i)
      cortex_mm.emplace_back(low.z() + options.fill_at[i] * extent.z(), options.cortex_mm[i]);
    bone.inner = endosteum(bone.outer, low, box.max(), cortex_mm);
  }
  bone.fill_z_mm.clear();
  for (double at : options.fill_at) bone.fill_z_mm.push_back(low.z() + at * extent.z());
  bone.fill_fraction = options.fill_fraction;
  bone.thigh_radius_mm = options.thigh_radius_mm;
  bone.fat_mm = options.fat_mm;
  phantom::place_distal_end(bone, options.isocentre_from_distal_end_mm);
  bone.thigh_centre_mm = Eigen::Vector2d::Zero();
  phantom::check_bone(bone, "simulate.surface");
  return bone;
}

}  // namespace

MARROW_PLUGIN(plugin) {
  plugin.node("simulate.surface", surface)
      .summary("Makes a bone from closed surfaces in files (STL, PLY, OBJ or VTP), or from one that another node made")
      .in("mesh", "the outer surface, in place of a file; scale does not count for it")
      .out("bone", "bone with a closed outer and a closed inner surface")
      .option("outer", &SurfaceOptions::outer, "file of the outer surface: .stl, .ply, .obj or .vtp")
      .relation(exactly_one({"in.mesh", "outer"}))
      .option("inner", &SurfaceOptions::inner,
              "file of the endosteal surface; empty: solid cortical bone, or as cortex_mm says")
      .option("cortex_mm", &SurfaceOptions::cortex_mm,
              "thickness of the cortical bone at the heights of fill_at, for a bone whose endosteal surface is not "
              "known; empty: none")
      .option("long_bone", &SurfaceOptions::long_bone,
              "whether the bone has a long axis, which must lie along z; false for one like a vertebra or a pelvis")
      .option("scale", &SurfaceOptions::scale, "factor that converts the file's unit to mm: 1000 for metres",
              at_least(1e-6), unit(""))
      .option("rotation_deg", &SurfaceOptions::rotation_deg,
              "rotations about x, then y, then z, after which the long axis is z with the distal end at low z, +x to "
              "the patient's left and +y to the back")
      .option("fill_at", &SurfaceOptions::fill_at,
              "heights, as fractions of the length, for which fill_fraction gives values", unit(""))
      .option("fill_fraction", &SurfaceOptions::fill_fraction,
              "share of bone inside the inner surface at these heights; the rest is marrow", unit(""))
      .relation(same_length({"fill_at", "fill_fraction"}))
      .relation(as_many_or_none("cortex_mm", "fill_at"))
      .option("isocentre_from_distal_end_mm", &SurfaceOptions::isocentre_from_distal_end_mm,
              "height of the isocentre (origin) above the distal end")
      .option("thigh_radius_mm", &SurfaceOptions::thigh_radius_mm, "radius of the soft tissue around the bone; 0: none",
              at_least(0))
      .option("fat_mm", &SurfaceOptions::fat_mm, "thickness of the layer of fat", at_least(0));
}
