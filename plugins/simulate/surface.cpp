// SPDX-License-Identifier: Apache-2.0
// A bone from surface files, for example the outer and the endosteal surface of a real femur.
#include <Eigen/Geometry>
#include <algorithm>
#include <filesystem>
#include <marrow/plugin.hpp>

#include "marrow/toolbox/files/mesh_file.hpp"
#include "marrow/toolbox/phantom/phantom.hpp"

namespace {

using namespace marrow;
using phantom::Bone;

struct SurfaceOptions {
  std::filesystem::path outer;
  std::filesystem::path inner;
  double scale = 1;
  std::array<double, 3> rotation_deg{0, 0, 0};
  std::vector<double> fill_at{0, 0.06, 0.16, 0.24, 0.74, 0.84, 1};
  std::vector<double> fill_fraction{0.30, 0.24, 0.15, 0, 0, 0.16, 0.30};
  double isocentre_from_distal_end_mm = 70;
  double thigh_radius_mm = 80;
  double fat_mm = 12;
};

Mesh placed(const std::filesystem::path& path, const SurfaceOptions& options) {
  Mesh mesh = files::read_mesh_file(path, 1);
  const auto about = [&](std::size_t k, const Eigen::Vector3d& axis) {
    return Eigen::AngleAxisd(radians(options.rotation_deg[k]), axis).toRotationMatrix();
  };
  const Eigen::Matrix3d rotation =
      about(2, Eigen::Vector3d::UnitZ()) * about(1, Eigen::Vector3d::UnitY()) * about(0, Eigen::Vector3d::UnitX());
  for (auto& vertex : mesh.vertices_mm) vertex = options.scale * (rotation * vertex);
  mesh.frame = "bone";
  return mesh;
}

Bone surface(const SurfaceOptions& options) {
  Bone bone;
  bone.outer = placed(options.outer, options);
  if (!options.inner.empty()) bone.inner = placed(options.inner, options);
  Eigen::Vector3d low = bone.outer.vertices_mm.front(), high = low;
  for (const auto& vertex : bone.outer.vertices_mm) {
    low = low.cwiseMin(vertex);
    high = high.cwiseMax(vertex);
  }
  const Eigen::Vector3d extent = high - low;
  if (extent.z() < std::max(extent.x(), extent.y()))
    throw Error("simulate.surface: the bone's long axis must lie along z with the distal end low, but it extends " +
                std::to_string(extent.x()) + " x " + std::to_string(extent.y()) + " x " + std::to_string(extent.z()) +
                " mm; turn it with rotation_deg");
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
      .summary("Makes a bone from closed surfaces in STL files")
      .out("bone", "bone with a closed outer and a closed inner surface")
      .option("outer", &SurfaceOptions::outer, "STL file of the outer surface", required())
      .option("inner", &SurfaceOptions::inner, "STL file of the endosteal surface; empty: solid cortical bone")
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
      .option("isocentre_from_distal_end_mm", &SurfaceOptions::isocentre_from_distal_end_mm,
              "height of the isocentre (origin) above the distal end")
      .option("thigh_radius_mm", &SurfaceOptions::thigh_radius_mm, "radius of the soft tissue around the bone; 0: none",
              at_least(0))
      .option("fat_mm", &SurfaceOptions::fat_mm, "thickness of the layer of fat", at_least(0));
}
