// SPDX-License-Identifier: Apache-2.0
#include "surface.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <numeric>

#include "marrow/domain/error.hpp"
#include "marrow/domain/transform.hpp"

namespace surface {

using marrow::Error;
using marrow::Mesh;

void check_field(const marrow::SignedField& field) {
  const auto& size = field.grid.size;
  if (size[0] <= 0 || size[1] <= 0 || size[2] <= 0 || field.values_mm.size() != field.grid.count())
    throw Error("field: " + std::to_string(field.values_mm.size()) + " values do not fill a grid of " +
                std::to_string(size[0]) + " x " + std::to_string(size[1]) + " x " + std::to_string(size[2]) +
                " voxels; wire the output of a segment node");
  marrow::check_rigid({field.grid.frame, "grid", field.grid.direction, field.grid.origin_mm}, "field");
  bool inside = false, outside = false, finite = true;
  for (float value : field.values_mm) {
    finite &= std::isfinite(value);
    inside |= value < 0;
    outside |= value >= 0;
  }
  if (!finite) throw Error("field: some values are not finite numbers; a signed distance in mm was expected");
  if (!inside)
    throw Error(
        "field: there is no surface, as no value is negative (inside); the segmentation found nothing: check its "
        "seeds and thresholds");
  if (!outside)
    throw Error(
        "field: there is no surface, as every value is negative (inside); the segmentation ran over the whole "
        "volume: raise its threshold");
}

Mesh largest_component(const Mesh& mesh) {
  std::vector<std::uint32_t> root(mesh.vertices_mm.size());
  std::iota(root.begin(), root.end(), 0u);
  const auto find = [&](std::uint32_t v) {
    while (root[v] != v) v = root[v] = root[root[v]];
    return v;
  };
  for (const auto& t : mesh.triangles)
    for (int k = 1; k < 3; ++k) {
      const std::uint32_t a = find(t[0]), b = find(t[k]);
      root[std::max(a, b)] = std::min(a, b);
    }
  std::vector<double> volume(root.size(), 0);
  const Eigen::Vector3d origin = mesh.vertices_mm.front();
  for (const auto& t : mesh.triangles) {
    const Eigen::Vector3d a = mesh.vertices_mm[t[0]] - origin, b = mesh.vertices_mm[t[1]] - origin,
                          c = mesh.vertices_mm[t[2]] - origin;
    volume[find(t[0])] += a.dot(b.cross(c));
  }
  const auto best = std::uint32_t(std::max_element(volume.begin(), volume.end()) - volume.begin());

  Mesh kept;
  kept.frame = mesh.frame;
  std::vector<std::uint32_t> index(root.size());
  for (std::uint32_t v = 0; v < root.size(); ++v)
    if (find(v) == best) {
      index[v] = std::uint32_t(kept.vertices_mm.size());
      kept.vertices_mm.push_back(mesh.vertices_mm[v]);
    }
  for (const auto& t : mesh.triangles)
    if (find(t[0]) == best) kept.triangles.push_back({index[t[0]], index[t[1]], index[t[2]]});
  return kept;
}

void smooth(Mesh& mesh, int iterations) {
  constexpr double kLambda = 0.5, kPassBand = 0.1, kMu = 1 / (kPassBand - 1 / kLambda);
  // On a closed surface each edge occurs once in either direction, so each neighbour is met exactly once here.
  std::vector<std::uint32_t> degree(mesh.vertices_mm.size(), 0);
  for (const auto& t : mesh.triangles)
    for (std::uint32_t v : t) ++degree[v];
  std::vector<Eigen::Vector3d> sum(mesh.vertices_mm.size());
  for (int step = 0; step < 2 * iterations; ++step) {
    std::fill(sum.begin(), sum.end(), Eigen::Vector3d::Zero());
    for (const auto& t : mesh.triangles)
      for (int k = 0; k < 3; ++k) sum[t[k]] += mesh.vertices_mm[t[(k + 1) % 3]];
    const double weight = step % 2 ? kMu : kLambda;
    for (std::size_t v = 0; v < sum.size(); ++v)
      mesh.vertices_mm[v] += weight * (sum[v] / degree[v] - mesh.vertices_mm[v]);
  }
}

}  // namespace surface
