// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <oneapi/tbb/parallel_invoke.h>
#include <oneapi/tbb/parallel_sort.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <marrow/domain/mesh.hpp>
#include <numeric>

/// A surface cut into patches of up to 32 neighbouring triangles with similar normals. A whole patch can be skipped if
/// none of its normals can be perpendicular to the line of sight. Vertices are stored once per patch, with one array
/// per coordinate.
struct SurfacePatches {
  struct Patch {
    std::uint32_t first_vertex, vertex_count, first_triangle, triangle_count, first_rim, rim_count;
  };
  /// For each patch the sphere around its vertices and the cone around their normals.
  struct Bounds {
    std::vector<float> x, y, z, radius, axis_x, axis_y, axis_z;
    std::vector<float> cone_sine;  ///< sine of the cone's half opening angle; 1 for angles from 90 degrees on
  };
  std::vector<Patch> patches;
  Bounds bounds;
  std::vector<float> x, y, z, nx, ny, nz;  ///< of each vertex: position relative to origin_mm [mm], unit normal
  std::vector<char> at_border;             ///< of each vertex: the surface ends there because the CT ends
  std::vector<std::array<std::uint8_t, 3>> triangles;  ///< indices within the patch
  std::vector<std::array<std::uint8_t, 2>> rims;  ///< edges with one triangle only (open surface), in its direction
  Eigen::Vector3d origin_mm;
};

namespace marrow::surface {

using Triangle = std::array<std::uint32_t, 3>;
using Feature = Eigen::Matrix<float, 6, 1>;

/// The triangles with equal vertices merged, because a surface from STL may repeat vertices.
inline std::vector<Triangle> weld(const marrow::Mesh& mesh) {
  std::vector<std::uint32_t> order(mesh.vertices_mm.size()), kept(order.size());
  std::iota(order.begin(), order.end(), 0u);
  const auto key = [&](std::uint32_t i) {
    const Eigen::Vector3d& v = mesh.vertices_mm[i];
    return std::make_tuple(v.x(), v.y(), v.z(), i);
  };
  tbb::parallel_sort(order.begin(), order.end(), [&](auto a, auto b) { return key(a) < key(b); });
  for (std::size_t i = 0; i < order.size(); ++i) {
    const bool same = i > 0 && mesh.vertices_mm[order[i]] == mesh.vertices_mm[order[i - 1]];
    kept[order[i]] = same ? kept[order[i - 1]] : order[i];
  }
  std::vector<Triangle> triangles;
  for (const Triangle& t : mesh.triangles) {
    const Triangle welded{kept[t[0]], kept[t[1]], kept[t[2]]};
    if (welded[0] != welded[1] && welded[1] != welded[2] && welded[2] != welded[0]) triangles.push_back(welded);
  }
  return triangles;
}

/// Unit normals of the vertices: the mean of their triangles' normals, weighted by area.
inline std::vector<Eigen::Vector3d> vertex_normals(const marrow::Mesh& mesh, const std::vector<Triangle>& triangles) {
  std::vector<Eigen::Vector3d> normals(mesh.vertices_mm.size(), Eigen::Vector3d::Zero());
  for (const Triangle& t : triangles) {
    const Eigen::Vector3d& a = mesh.vertices_mm[t[0]];
    const Eigen::Vector3d area = (mesh.vertices_mm[t[1]] - a).cross(mesh.vertices_mm[t[2]] - a);
    for (std::uint32_t corner : t) normals[corner] += area;
  }
  for (Eigen::Vector3d& normal : normals) normal.normalize();
  return normals;
}

/// Sorts order[first, last) into groups of at most `most` triangles, by repeated halving along the feature with the
/// largest range.
inline void split(std::vector<std::uint32_t>& order, const std::vector<Feature>& features, std::size_t first,
                  std::size_t last, std::size_t most) {
  if (last - first <= most) return;
  Feature low = features[order[first]], high = low;
  for (std::size_t i = first; i < last; ++i) {
    low = low.cwiseMin(features[order[i]]);
    high = high.cwiseMax(features[order[i]]);
  }
  Eigen::Index widest;
  (high - low).maxCoeff(&widest);
  const std::size_t middle = (first + last) / 2;
  std::nth_element(order.begin() + long(first), order.begin() + long(middle), order.begin() + long(last),
                   [&](auto a, auto b) {
                     const float fa = features[a][widest], fb = features[b][widest];
                     return fa != fb ? fa < fb : a < b;
                   });
  constexpr std::size_t kWorthATask = 4096;
  const auto left = [&] { split(order, features, first, middle, most); };
  const auto right = [&] { split(order, features, middle, last, most); };
  if (last - first > kWorthATask)
    tbb::parallel_invoke(left, right);
  else
    left(), right();
}

/// The ends of the groups that split() makes.
inline void find_ends(std::size_t first, std::size_t last, std::size_t most, std::vector<std::size_t>& ends) {
  if (last - first <= most) return ends.push_back(last);
  find_ends(first, (first + last) / 2, most, ends);
  find_ends((first + last) / 2, last, most, ends);
}

/// For each triangle, bit k is set if no other triangle shares its edge k -> k+1. Edges are sorted into bins by their
/// lower vertex.
inline std::vector<std::uint8_t> rim_edges(const std::vector<Triangle>& triangles, std::size_t vertices) {
  struct Edge {
    std::uint32_t higher, at;  ///< vertex; 3 * triangle + k
  };
  const auto lower = [&](std::size_t i, std::size_t k) { return std::min(triangles[i][k], triangles[i][(k + 1) % 3]); };
  std::vector<std::uint32_t> first(vertices + 1, 0);
  for (std::size_t i = 0; i < triangles.size(); ++i)
    for (std::size_t k = 0; k < 3; ++k) ++first[lower(i, k) + 1];
  for (std::size_t v = 0; v < vertices; ++v) first[v + 1] += first[v];
  std::vector<Edge> edges(3 * triangles.size());
  std::vector<std::uint32_t> next(first.begin(), first.end() - 1);
  for (std::size_t i = 0; i < triangles.size(); ++i)
    for (std::size_t k = 0; k < 3; ++k)
      edges[next[lower(i, k)]++] = {std::max(triangles[i][k], triangles[i][(k + 1) % 3]), std::uint32_t(3 * i + k)};
  std::vector<std::uint8_t> rims(triangles.size(), 0);
  for (std::size_t v = 0; v < vertices; ++v)
    for (std::uint32_t i = first[v]; i < first[v + 1]; ++i) {
      std::uint32_t shared = 0;
      for (std::uint32_t j = first[v]; j < first[v + 1]; ++j) shared += edges[j].higher == edges[i].higher;
      if (shared == 1) rims[edges[i].at / 3] |= std::uint8_t(1u << (edges[i].at % 3));
    }
  return rims;
}

inline void bound(SurfacePatches& s, const SurfacePatches::Patch& patch) {
  const auto point = [&](std::size_t i) { return Eigen::Vector3f(s.x[i], s.y[i], s.z[i]); };
  const auto normal = [&](std::size_t i) { return Eigen::Vector3f(s.nx[i], s.ny[i], s.nz[i]); };
  const std::size_t first = patch.first_vertex, last = first + patch.vertex_count;
  Eigen::Vector3f centre = Eigen::Vector3f::Zero(), axis = Eigen::Vector3f::Zero();
  for (std::size_t i = first; i < last; ++i) {
    centre += point(i) / float(patch.vertex_count);
    axis += normal(i);
  }
  axis = axis.norm() > 1e-3f ? Eigen::Vector3f(axis.normalized()) : Eigen::Vector3f::UnitZ();
  float radius = 0, least_cosine = 1;
  for (std::size_t i = first; i < last; ++i) {
    radius = std::max(radius, (point(i) - centre).norm());
    least_cosine = std::min(least_cosine, normal(i).dot(axis));
  }
  SurfacePatches::Bounds& b = s.bounds;
  b.x.push_back(centre.x()), b.y.push_back(centre.y()), b.z.push_back(centre.z()), b.radius.push_back(radius);
  b.axis_x.push_back(axis.x()), b.axis_y.push_back(axis.y()), b.axis_z.push_back(axis.z());
  b.cone_sine.push_back(least_cosine <= 0 ? 1 : std::sqrt(std::max(0.0f, 1 - least_cosine * least_cosine)));
}

}  // namespace marrow::surface

/// Cuts a surface into patches. `at_border`: one value per vertex of the mesh (see vertices_at_volume_border()).
inline SurfacePatches make_surface_patches(const marrow::Mesh& mesh, const std::vector<char>& at_border) {
  using namespace marrow::surface;
  constexpr std::size_t kTriangles = 32;
  constexpr float kNormalScale_mm = 15;  // normals that differ by 1 rad count like this distance
  std::vector<Triangle> triangles = mesh.triangles;
  std::vector<std::uint8_t> rims = rim_edges(triangles, mesh.vertices_mm.size());
  // A closed surface repeats no vertices, so only an open one is welded.
  if (std::any_of(rims.begin(), rims.end(), [](std::uint8_t bits) { return bits; })) {
    triangles = weld(mesh);
    rims = rim_edges(triangles, mesh.vertices_mm.size());
  }
  const std::vector<Eigen::Vector3d> normals = vertex_normals(mesh, triangles);
  SurfacePatches s;
  s.origin_mm = marrow::fragment_frame(mesh).origin_mm;

  std::vector<Feature> features(triangles.size());
  for (std::size_t i = 0; i < triangles.size(); ++i) {
    const auto& t = triangles[i];
    const Eigen::Vector3d centre =
        (mesh.vertices_mm[t[0]] + mesh.vertices_mm[t[1]] + mesh.vertices_mm[t[2]]) / 3 - s.origin_mm;
    const Eigen::Vector3d normal = (normals[t[0]] + normals[t[1]] + normals[t[2]]) / 3;
    features[i] << centre.cast<float>(), normal.cast<float>() * kNormalScale_mm;
  }
  std::vector<std::uint32_t> order(triangles.size());
  std::iota(order.begin(), order.end(), 0u);
  std::vector<std::size_t> ends;
  split(order, features, 0, order.size(), kTriangles);
  find_ends(0, order.size(), kTriangles, ends);

  std::size_t first = 0;
  for (const std::size_t last : ends) {
    SurfacePatches::Patch patch{};
    patch.first_vertex = std::uint32_t(s.x.size());
    patch.first_triangle = std::uint32_t(s.triangles.size());
    patch.first_rim = std::uint32_t(s.rims.size());
    std::vector<std::uint32_t> local;
    for (; first < last; ++first) {
      std::array<std::uint8_t, 3> corners{};
      for (std::size_t k = 0; k < 3; ++k) {
        const std::uint32_t vertex = triangles[order[first]][k];
        const auto at = std::find(local.begin(), local.end(), vertex);
        corners[k] = std::uint8_t(at - local.begin());
        if (at != local.end()) continue;
        local.push_back(vertex);
        const Eigen::Vector3f p = (mesh.vertices_mm[vertex] - s.origin_mm).cast<float>();
        const Eigen::Vector3f n = normals[vertex].cast<float>();
        s.x.push_back(p.x()), s.y.push_back(p.y()), s.z.push_back(p.z());
        s.nx.push_back(n.x()), s.ny.push_back(n.y()), s.nz.push_back(n.z());
        s.at_border.push_back(at_border[vertex]);
      }
      s.triangles.push_back(corners);
      for (std::size_t k = 0; k < 3; ++k)
        if (rims[order[first]] >> k & 1) s.rims.push_back({corners[k], corners[(k + 1) % 3]});
    }
    patch.vertex_count = std::uint32_t(s.x.size()) - patch.first_vertex;
    patch.triangle_count = std::uint32_t(s.triangles.size()) - patch.first_triangle;
    patch.rim_count = std::uint32_t(s.rims.size()) - patch.first_rim;
    bound(s, patch);
    s.patches.push_back(patch);
  }
  return s;
}
