// SPDX-License-Identifier: Apache-2.0
#include "marrow/domain/mesh.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

#include "marrow/base/error.hpp"
#include "marrow/base/number_text.hpp"
#include "marrow/domain/decompositions.hpp"

namespace marrow {
namespace {

constexpr const char* kNoArea =
    ": the surface has no area, as all its triangles are points or lines; check the file or the node that it is from";
constexpr double kFarthest_mm = 1e6;  // larger than any room; up to here, sums of squares are exact enough

std::string in_metres(double length_mm) { return formatted("{:.3g} m", length_mm / 1000); }

/// Twice the area of a triangle, as a vector along its outward normal.
Eigen::Vector3d area_vector(const Mesh& mesh, const std::array<std::uint32_t, 3>& t) {
  const Eigen::Vector3d& a = mesh.vertices_mm[t[0]];
  return (mesh.vertices_mm[t[1]] - a).cross(mesh.vertices_mm[t[2]] - a);
}

}  // namespace

void check_mesh(const Mesh& mesh, const std::string& what) {
  if (mesh.triangles.empty()) throw Error(what + ": the surface has no triangles");
  for (const auto& t : mesh.triangles)
    for (std::uint32_t corner : t)
      if (corner >= mesh.vertices_mm.size())
        throw Error(
            formatted("{}: a triangle names vertex {}, but there are only {}", what, corner, mesh.vertices_mm.size()));
  for (const auto& vertex : mesh.vertices_mm)
    if (!vertex.allFinite())
      throw Error(what + ": a vertex is not finite");
    else if (!(vertex.cwiseAbs().maxCoeff() <= kFarthest_mm))
      throw Error(what + ": a vertex lies " + in_metres(vertex.cwiseAbs().maxCoeff()) +
                  " from the origin; expected coordinates in mm, of at most 1 km");
  if (!(surface_area_mm2(mesh) > 0)) throw Error(what + kNoArea);
}

bool is_closed(const Mesh& mesh) {
  std::vector<std::pair<std::uint64_t, int>> edges;  // undirected edge, and +1 or -1 for its direction
  edges.reserve(mesh.triangles.size() * 3);
  for (const auto& t : mesh.triangles)
    for (int k = 0; k < 3; ++k) {
      const std::uint64_t a = t[k], b = t[(k + 1) % 3];
      edges.emplace_back(std::min(a, b) << 32 | std::max(a, b), a < b ? 1 : -1);
    }
  std::sort(edges.begin(), edges.end());
  if (edges.empty() || edges.size() % 2) return false;
  for (std::size_t i = 0; i < edges.size(); i += 2) {
    if (edges[i].first != edges[i + 1].first || edges[i].second == edges[i + 1].second) return false;
    if (i + 2 < edges.size() && edges[i + 2].first == edges[i].first) return false;
  }
  return true;
}

bool is_manifold(const Mesh& mesh) {
  if (!is_closed(mesh)) return false;
  struct Corner {
    std::uint32_t vertex, next, last;  ///< the vertices of a triangle, in its order
    bool operator<(const Corner& other) const {
      return vertex != other.vertex ? vertex < other.vertex : next < other.next;
    }
  };
  std::vector<Corner> corners;
  corners.reserve(3 * mesh.triangles.size());
  for (const auto& t : mesh.triangles)
    for (std::size_t k = 0; k < 3; ++k) corners.push_back({t[k], t[(k + 1) % 3], t[(k + 2) % 3]});
  std::sort(corners.begin(), corners.end());
  for (auto begin = corners.begin(); begin != corners.end();) {
    const auto end =
        std::find_if(begin, corners.end(), [&](const Corner& corner) { return corner.vertex != begin->vertex; });
    // Walk from triangle to triangle around the vertex. The mesh is closed, so the walk returns to its start.
    auto at = begin;
    std::ptrdiff_t passed = 0;
    do {
      at = std::lower_bound(begin, end, Corner{at->vertex, at->last, 0});
      ++passed;
    } while (at != begin);
    if (passed != end - begin) return false;
    begin = end;
  }
  return true;
}

void check_closed_surface(const Mesh& mesh, const std::string& what) {
  check_mesh(mesh, what);
  if (!is_closed(mesh))
    throw Error(what +
                ": the surface is open or not consistently oriented, so it has no inside; close its holes (each edge "
                "must be shared by exactly two triangles)");
  if (const double volume_mm3 = enclosed_volume_mm3(mesh); !(volume_mm3 > 0))
    throw Error(
        formatted("{}: the triangles face inward (enclosed volume {:f} mm3); reverse their order", what, volume_mm3));
}

double enclosed_volume_mm3(const Mesh& mesh) {
  double six_volumes = 0;
  for (const auto& t : mesh.triangles) six_volumes += mesh.vertices_mm[t[0]].dot(area_vector(mesh, t));
  return six_volumes / 6;
}

double surface_area_mm2(const Mesh& mesh) {
  double area = 0;
  for (const auto& t : mesh.triangles) area += 0.5 * area_vector(mesh, t).norm();
  return area;
}

std::vector<Eigen::Vector3d> sample_surface(const Mesh& mesh, std::size_t count) {
  const double step = surface_area_mm2(mesh) / double(count);
  if (!(step > 0)) throw Error(std::string("points on a surface") + kNoArea);
  std::vector<Eigen::Vector3d> points;
  double passed = 0;
  for (const auto& t : mesh.triangles) {
    const double area = 0.5 * area_vector(mesh, t).norm();
    // Put a point wherever the running area passes (i + 1/2) * `step`. Its place in the triangle follows the golden
    // ratio.
    for (double at = (double(points.size()) + 0.5) * step; at < passed + area && points.size() < count;
         at = (double(points.size()) + 0.5) * step) {
      const double r = (at - passed) / area, q = std::fmod(double(points.size()) * 0.6180339887498949, 1.0);
      const double s = std::sqrt(r);
      points.push_back((1 - s) * mesh.vertices_mm[t[0]] + s * (1 - q) * mesh.vertices_mm[t[1]] +
                       s * q * mesh.vertices_mm[t[2]]);
    }
    passed += area;
  }
  return points;
}

FragmentFrame fragment_frame(const Mesh& mesh) {
  check_mesh(mesh, "fragment frame");
  double area = 0;
  Eigen::Vector3d first = Eigen::Vector3d::Zero();
  Eigen::Matrix3d second = Eigen::Matrix3d::Zero();
  for (const auto& t : mesh.triangles) {  // exact moments of a triangle of uniform weight
    const double weight = 0.5 * area_vector(mesh, t).norm();
    const Eigen::Vector3d &a = mesh.vertices_mm[t[0]], &b = mesh.vertices_mm[t[1]], &c = mesh.vertices_mm[t[2]];
    const Eigen::Vector3d centre = (a + b + c) / 3;
    area += weight;
    first += weight * centre;
    second +=
        weight / 12 * (9 * centre * centre.transpose() + a * a.transpose() + b * b.transpose() + c * c.transpose());
  }
  FragmentFrame frame;
  frame.is_anatomical = true;
  frame.origin_mm = first / area;
  const Eigen::Matrix3d covariance = second / area - frame.origin_mm * frame.origin_mm.transpose();
  Eigen::Vector3d along = eigen_of_symmetric(covariance).vectors.col(2);
  if (along.z() < 0) along = -along;
  const Eigen::Vector3d reference = std::abs(along.x()) < 0.9 ? Eigen::Vector3d::UnitX() : Eigen::Vector3d::UnitY();
  const Eigen::Vector3d frontal = (reference - along * along.dot(reference)).normalized();
  frame.axes << frontal, along.cross(frontal), along;
  return frame;
}

}  // namespace marrow
