// SPDX-License-Identifier: Apache-2.0
#include "marrow/toolbox/exchange/surface_file.hpp"

#include <Eigen/Geometry>
#include <numeric>

#include "marrow/base/error.hpp"
#include "marrow/base/number_text.hpp"
#include "marrow/toolbox/files/header_lines.hpp"
#include "marrow/toolbox/files/length_units.hpp"
#include "polygons_file.hpp"
#include "surface_shape.hpp"

namespace marrow::exchange {
namespace {

files::MarkedMesh marked_mesh(const std::filesystem::path& path) {
  const std::string end = files::extension_of(path);
  if (end == ".stl" || end == ".ply") return files::read_marked_mesh(path);
  if (end != ".obj" && end != ".vtp")
    throw Error(path.string() + ": not a surface that can be read; known are .stl, .ply, .obj and .vtp");
  const FilePolygons file = end == ".obj" ? read_obj(path) : read_vtp(path);
  return {files::mesh_of(file.polygons, path.string()), file.space};
}

void turn(Mesh& mesh, SurfaceShape& shape, const std::vector<std::uint32_t>& parts) {
  std::vector<bool> is_turned(shape.part_volumes_mm3.size(), false);
  for (const std::uint32_t part : parts) {
    is_turned[part] = true;
    shape.part_volumes_mm3[part] *= -1;
  }
  for (std::size_t i = 0; i < mesh.triangles.size(); ++i)
    if (is_turned[shape.part_of_triangle[i]]) std::swap(mesh.triangles[i][1], mesh.triangles[i][2]);
}

/// For open surfaces: whether the volume between the surface and the mean of its corners is negative.
bool seems_to_face_inwards(const Mesh& mesh) {
  Mesh centred = mesh;
  Eigen::Vector3d middle = Eigen::Vector3d::Zero();
  for (const Eigen::Vector3d& vertex : mesh.vertices_mm) middle += vertex / double(mesh.vertices_mm.size());
  for (Eigen::Vector3d& vertex : centred.vertices_mm) vertex -= middle;
  return enclosed_volume_mm3(centred) < 0;
}

std::string edges_text(std::size_t count, const std::string& rest) {
  return count == 0 ? "" : (count == 1 ? "; 1 edge belongs" : formatted("; {} edges belong", count)) + rest;
}

void warn_of_open(const Mesh& mesh, const SurfaceShape& shape, const std::string& what, const Context& context) {
  const std::string edges =
      edges_text(shape.open_edges, " to one triangle only, so the surface is open") +
      edges_text(shape.crowded_edges, " to more than two triangles") +
      edges_text(shape.contrary_edges, " to two triangles that face different sides") +
      (seems_to_face_inwards(mesh) ? "; most of its triangles seem to face inwards: turn them" : "");
  context.warn(what + ": the surface has no certain inside" + edges +
               "; costs that need its outline or its inside may be wrong: repair it (MeshLab, Blender)");
}

/// Turns a closed surface that faces inwards. The surface as a whole decides first, because cavities face inwards as
/// well, and then each part that is no cavity.
void check_closed(Mesh& mesh, SurfaceShape& shape, const std::string& what, const Context& context) {
  const double volume_mm3 = std::accumulate(shape.part_volumes_mm3.begin(), shape.part_volumes_mm3.end(), 0.0);
  const std::size_t count = shape.part_volumes_mm3.size();
  if (volume_mm3 < 0) {
    std::vector<std::uint32_t> all(count);
    std::iota(all.begin(), all.end(), 0u);
    turn(mesh, shape, all);
  }
  const std::vector<std::uint32_t> others = parts_inside_out(mesh, shape);
  turn(mesh, shape, others);
  const std::size_t turned = volume_mm3 < 0 ? count - others.size() : others.size();
  if (turned == 0) return;
  const std::string which =
      turned == count
          ? formatted("all its triangles faced inwards (enclosed volume {:.6g} mm3)", volume_mm3)
          : formatted("{} of its {} closed parts faced inwards without being a cavity in another part", turned, count);
  context.warn(what + ": " + which +
               ", so they were turned; if the surface was mirrored on its way here, it is still a mirror image");
}

void check_shape(Mesh& mesh, const std::string& what, const Context& context) {
  SurfaceShape shape = shape_of(mesh);
  if (shape.is_closed())
    check_closed(mesh, shape, what, context);
  else
    warn_of_open(mesh, shape, what, context);
  const Crossing crossing = crossing_of(mesh);
  if (const auto& at = crossing.place_mm)
    context.warn(what +
                 formatted(": the surface crosses itself, first seen at ({:.4g}, {:.4g}, {:.4g}) mm; what lies inside "
                           "is not certain there: repair it (MeshLab, Blender)",
                           at->x(), at->y(), at->z()));
  if (!crossing.is_whole) context.info(what + ": is too large to be searched for triangles that cross");
}

void check_size(const Mesh& mesh, double scale, const std::string& what, const Context& context) {
  constexpr double kSmallest_mm = 5, kLargest_mm = 1000, kLeastLikely_mm = 10;
  Eigen::AlignedBox3d box;
  for (const Eigen::Vector3d& vertex : mesh.vertices_mm) box.extend(vertex);
  const double largest_mm = box.sizes().maxCoeff();
  if (largest_mm >= kSmallest_mm && largest_mm <= kLargest_mm) return;
  context.warn(what +
               formatted(": the surface is {:.4g} mm large, where bones and implants have 5 to 1000", largest_mm) +
               files::likely_unit(largest_mm, kLeastLikely_mm, kLargest_mm, scale));
}

}  // namespace

Mesh read_surface_file(const std::filesystem::path& path, double scale, const Context& context) {
  const std::string what = path.string();
  files::MarkedMesh marked = marked_mesh(path);
  if (marked.space.is_contradicted())
    context.warn(what + ": names two frames in its comments, SPACE=LPS and SPACE=RAS; the first, " +
                 (marked.space.is_ras() ? "RAS" : "LPS") + ", is taken");
  Mesh mesh = files::in_lps_mm(std::move(marked), scale, what);
  check_shape(mesh, what, context);
  check_size(mesh, scale, what, context);
  return mesh;
}

}  // namespace marrow::exchange
