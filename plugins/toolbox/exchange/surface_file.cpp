// SPDX-License-Identifier: Apache-2.0
#include "marrow/toolbox/exchange/surface_file.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <numeric>
#include <optional>

#include "marrow/base/number_text.hpp"
#include "marrow/toolbox/files/camera_file.hpp"
#include "marrow/toolbox/files/header_lines.hpp"

namespace marrow::exchange {
namespace {

/// Its edges tell whether the surface has a certain inside. If it has, its parts tell which side that is.
struct SurfaceShape {
  std::size_t open_edges = 0;      ///< of one triangle
  std::size_t crowded_edges = 0;   ///< of more than two triangles
  std::size_t contrary_edges = 0;  ///< of two triangles that face different sides
  std::vector<std::uint32_t> part_of_triangle;
  std::vector<double> part_volumes_mm3;  ///< negative where the triangles face inwards; meaningless if not closed
  bool is_closed() const { return open_edges + crowded_edges + contrary_edges == 0; }
};

/// The place where two triangles without a common corner cross. `is_whole`: all pairs were compared. This can take too
/// long for a surface with very many long triangles.
struct Crossing {
  std::optional<Eigen::Vector3d> place_mm;
  bool is_whole = true;
};

struct EdgeOfTriangle {
  std::uint64_t corners = 0;  ///< the lower number in the upper half
  std::uint32_t triangle = 0;
  bool rises = false;  ///< it runs from the lower number to the higher one
};

std::vector<EdgeOfTriangle> sorted_edges(const Mesh& mesh) {
  std::vector<EdgeOfTriangle> edges;
  edges.reserve(mesh.triangles.size() * 3);
  for (std::uint32_t i = 0; i < mesh.triangles.size(); ++i)
    for (std::size_t k = 0; k < 3; ++k) {
      const std::uint64_t a = mesh.triangles[i][k], b = mesh.triangles[i][(k + 1) % 3];
      edges.push_back({std::min(a, b) << 32 | std::max(a, b), i, a < b});
    }
  std::sort(edges.begin(), edges.end(), [](const EdgeOfTriangle& a, const EdgeOfTriangle& b) {
    return a.corners != b.corners ? a.corners < b.corners : a.triangle < b.triangle;
  });
  return edges;
}

/// Which triangles are connected.
class Parts {
 public:
  explicit Parts(std::size_t triangles) : parent_(triangles) { std::iota(parent_.begin(), parent_.end(), 0u); }
  std::uint32_t root(std::uint32_t triangle) {
    while (parent_[triangle] != triangle) triangle = parent_[triangle] = parent_[parent_[triangle]];
    return triangle;
  }
  void join(std::uint32_t a, std::uint32_t b) {
    const std::uint32_t one = root(a), other = root(b);
    parent_[std::max(one, other)] = std::min(one, other);  // so the first triangle of a part is its root
  }

 private:
  std::vector<std::uint32_t> parent_;
};

void add_volumes(const Mesh& mesh, SurfaceShape& shape) {
  std::vector<Eigen::Vector3d> origins;  // one for each part: a far one would cost digits
  for (std::size_t i = 0; i < mesh.triangles.size(); ++i) {
    const auto& [a, b, c] = mesh.triangles[i];
    const std::uint32_t part = shape.part_of_triangle[i];
    if (part == origins.size()) {
      origins.push_back(mesh.vertices_mm[a]);
      shape.part_volumes_mm3.push_back(0);
    }
    const auto from_origin = [&](std::uint32_t v) -> Eigen::Vector3d { return mesh.vertices_mm[v] - origins[part]; };
    shape.part_volumes_mm3[part] += from_origin(a).dot(from_origin(b).cross(from_origin(c))) / 6;
  }
}

double cross(const Eigen::Vector3d& a, const Eigen::Vector3d& b) { return a.y() * b.z() - a.z() * b.y(); }

/// How many of the parts that face outwards hold the point: a ray along x leaves each of them once more than it enters.
int outward_parts_around(const Eigen::Vector3d& point, const Mesh& mesh, const SurfaceShape& shape) {
  int left = 0;
  for (std::size_t i = 0; i < mesh.triangles.size(); ++i) {
    if (!(shape.part_volumes_mm3[shape.part_of_triangle[i]] > 0)) continue;
    const auto& [v0, v1, v2] = mesh.triangles[i];
    const Eigen::Vector3d a = mesh.vertices_mm[v0] - point, b = mesh.vertices_mm[v1] - point,
                          c = mesh.vertices_mm[v2] - point;
    const double of_c = cross(a, b), of_a = cross(b, c), of_b = cross(c, a), sum = of_a + of_b + of_c;
    const bool is_met = (of_a > 0 && of_b > 0 && of_c > 0) || (of_a < 0 && of_b < 0 && of_c < 0);
    if (is_met && (of_a * a.x() + of_b * b.x() + of_c * c.x()) / sum > 0) left += sum > 0 ? 1 : -1;
  }
  return left;
}

using Eigen::Vector3d;
using Corners = std::array<Vector3d, 3>;

constexpr std::size_t kMostComparisons = 300'000'000;  // a second
constexpr double kRounding = 1e-6;                     // of the largest coordinate: files hold 7 digits

struct TriangleBox {
  Eigen::AlignedBox3d box;
  std::uint32_t triangle = 0;
};

Corners corners_of(const Mesh& mesh, std::uint32_t triangle) {
  const auto& [a, b, c] = mesh.triangles[triangle];
  return {mesh.vertices_mm[a], mesh.vertices_mm[b], mesh.vertices_mm[c]};
}

bool have_common_corner(const std::array<std::uint32_t, 3>& a, const std::array<std::uint32_t, 3>& b) {
  return std::find_first_of(a.begin(), a.end(), b.begin(), b.end()) != a.end();
}

/// Where the line from `from` to `to` goes through the triangle, if both ends are farther than `least_mm` from its
/// plane.
std::optional<Vector3d> meeting(const Vector3d& from, const Vector3d& to, const Corners& t, double least_mm) {
  const Vector3d normal = (t[1] - t[0]).cross(t[2] - t[0]).normalized();
  const double before = normal.dot(from - t[0]), after = normal.dot(to - t[0]);
  if (!(std::min(before, after) < -least_mm && std::max(before, after) > least_mm)) return std::nullopt;
  const Vector3d place = from + (to - from) * (before / (before - after));
  for (std::size_t k = 0; k < 3; ++k)
    if (!(normal.dot((t[(k + 1) % 3] - t[k]).cross(place - t[k])) > 0)) return std::nullopt;
  return place;
}

std::optional<Vector3d> crossing(const Corners& a, const Corners& b, double least_mm) {
  for (std::size_t k = 0; k < 3; ++k) {
    if (const auto place = meeting(a[k], a[(k + 1) % 3], b, least_mm)) return place;
    if (const auto place = meeting(b[k], b[(k + 1) % 3], a, least_mm)) return place;
  }
  return std::nullopt;
}

/// A part consists of triangles that are connected by edges. The mesh must satisfy check_mesh().
SurfaceShape shape_of(const Mesh& mesh) {
  SurfaceShape shape;
  Parts parts(mesh.triangles.size());
  const std::vector<EdgeOfTriangle> edges = sorted_edges(mesh);
  for (std::size_t begin = 0, end = 0; begin < edges.size(); begin = end) {
    for (end = begin; end < edges.size() && edges[end].corners == edges[begin].corners; ++end)
      parts.join(edges[begin].triangle, edges[end].triangle);
    shape.open_edges += end - begin == 1;
    shape.crowded_edges += end - begin > 2;
    shape.contrary_edges += end - begin == 2 && edges[begin].rises == edges[begin + 1].rises;
  }
  std::uint32_t count = 0;
  shape.part_of_triangle.resize(mesh.triangles.size());
  for (std::uint32_t i = 0; i < mesh.triangles.size(); ++i)
    shape.part_of_triangle[i] = parts.root(i) == i ? count++ : shape.part_of_triangle[parts.root(i)];
  add_volumes(mesh, shape);
  return shape;
}

/// The parts that face inwards although no part that faces outwards encloses them. Enclosed ones are cavities. The
/// surface must be closed. Only the largest 50 parts that face inwards are examined.
std::vector<std::uint32_t> parts_inside_out(const Mesh& mesh, const SurfaceShape& shape) {
  constexpr std::size_t kMostParts = 50;
  constexpr double kNothing = 1e-9;  // of the largest part: its sign is rounding
  const std::vector<double>& volumes = shape.part_volumes_mm3;
  double largest = 0;
  for (const double volume : volumes) largest = std::max(largest, std::abs(volume));
  std::vector<std::uint32_t> inward;
  for (std::uint32_t part = 0; part < volumes.size(); ++part)
    if (volumes[part] < -kNothing * largest) inward.push_back(part);
  std::stable_sort(inward.begin(), inward.end(), [&](auto a, auto b) { return volumes[a] < volumes[b]; });
  inward.resize(std::min(inward.size(), kMostParts));
  std::vector<std::uint32_t> found;
  for (const std::uint32_t part : inward) {
    const auto first = std::find(shape.part_of_triangle.begin(), shape.part_of_triangle.end(), part);
    const auto& [a, b, c] = mesh.triangles[std::size_t(first - shape.part_of_triangle.begin())];
    // Not the centre, because a ray from there might meet edges of regular surfaces.
    const Eigen::Vector3d point =
        0.5137 * mesh.vertices_mm[a] + 0.2713 * mesh.vertices_mm[b] + 0.215 * mesh.vertices_mm[c];
    if (outward_parts_around(point, mesh, shape) <= 0) found.push_back(part);
  }
  return found;
}

// A sweep along the surface's longest axis compares those whose boxes overlap.

Crossing crossing_of(const Mesh& mesh) {
  std::vector<TriangleBox> boxes;
  boxes.reserve(mesh.triangles.size());
  Eigen::AlignedBox3d all;
  for (std::uint32_t i = 0; i < mesh.triangles.size(); ++i) {
    TriangleBox one{{}, i};
    for (const Vector3d& corner : corners_of(mesh, i)) one.box.extend(corner);
    all.extend(one.box);
    boxes.push_back(one);
  }
  Eigen::Index axis = 0;
  all.sizes().maxCoeff(&axis);
  std::sort(boxes.begin(), boxes.end(), [&](const TriangleBox& a, const TriangleBox& b) {
    const double low_a = a.box.min()[axis], low_b = b.box.min()[axis];
    return low_a != low_b ? low_a < low_b : a.triangle < b.triangle;
  });
  const double least_mm = kRounding * std::max(all.min().cwiseAbs().maxCoeff(), all.max().cwiseAbs().maxCoeff());
  std::size_t comparisons = 0;
  for (std::size_t i = 0; i < boxes.size(); ++i)
    for (std::size_t k = i + 1; k < boxes.size() && boxes[k].box.min()[axis] <= boxes[i].box.max()[axis]; ++k) {
      if (++comparisons > kMostComparisons) return {std::nullopt, false};
      const std::uint32_t one = boxes[i].triangle, other = boxes[k].triangle;
      if (!boxes[i].box.intersects(boxes[k].box) || have_common_corner(mesh.triangles[one], mesh.triangles[other]))
        continue;
      if (const auto place = crossing(corners_of(mesh, one), corners_of(mesh, other), least_mm)) return {place, true};
    }
  return {};
}

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
