// SPDX-License-Identifier: Apache-2.0
#include "marrow/domain/volume.hpp"

#include <algorithm>
#include <cmath>

#include "marrow/base/error.hpp"
#include "marrow/base/number_text.hpp"
#include "marrow/domain/transform.hpp"

namespace marrow {
namespace {

constexpr double kFinest_mm = 0.001, kCoarsest_mm = 100, kFarthestOrigin_mm = 1e6;

std::string size_text(const Grid& grid) { return formatted("{} x {} x {}", grid.size[0], grid.size[1], grid.size[2]); }

/// The largest distance between voxels of the same index. It is that of a corner, because places are linear in indices.
double farthest_apart_mm(const Grid& a, const Grid& b) {
  double farthest_mm = 0;
  for (int corner = 0; corner < 8; ++corner) {
    Eigen::Vector3d index;
    for (int k = 0; k < 3; ++k) index[k] = corner >> k & 1 ? a.size[std::size_t(k)] - 1 : 0;
    farthest_mm = std::max(farthest_mm, (a.point_from_index(index) - b.point_from_index(index)).norm());
  }
  return farthest_mm;
}

}  // namespace

float sample_trilinear(const Grid& grid, const std::vector<float>& values, const Eigen::Vector3d& index) {
  int base[3];
  float fraction[3];
  for (int k = 0; k < 3; ++k) {
    const double clamped = std::clamp(index[k], 0.0, double(grid.size[k] - 1));
    base[k] = std::min(int(clamped), std::max(0, grid.size[k] - 2));
    fraction[k] = float(clamped - base[k]);
  }
  const std::size_t step_x = grid.size[0] > 1 ? 1 : 0;
  const std::size_t step_y = grid.size[1] > 1 ? std::size_t(grid.size[0]) : 0;
  const std::size_t step_z = grid.size[2] > 1 ? std::size_t(grid.size[0]) * grid.size[1] : 0;
  const float* v = values.data() + grid.offset(base[0], base[1], base[2]);
  const auto along_x = [&](std::size_t at) { return v[at] + fraction[0] * (v[at + step_x] - v[at]); };
  const auto along_y = [&](std::size_t at) {
    const float first = along_x(at);
    return first + fraction[1] * (along_x(at + step_y) - first);
  };
  const float first = along_y(0);
  return first + fraction[2] * (along_y(step_z) - first);
}

void check_volume(const Volume& volume, const std::string& what) {
  const Grid& grid = volume.grid;
  for (int k = 0; k < 3; ++k) {
    if (grid.size[k] <= 0)
      throw Error(
          formatted("{}: the volume is empty (size {} x {} x {})", what, grid.size[0], grid.size[1], grid.size[2]));
    if (!(grid.spacing_mm[k] > 0) || !std::isfinite(grid.spacing_mm[k]))
      throw Error(formatted("{}: voxel spacing {:f} mm is not a positive length", what, grid.spacing_mm[k]));
    if (grid.spacing_mm[k] < kFinest_mm || grid.spacing_mm[k] > kCoarsest_mm)
      throw Error(formatted("{}: voxel spacing {:.6g} mm; expected {:.6g} to {:.6g} mm: is it in another unit?", what,
                            grid.spacing_mm[k], kFinest_mm, kCoarsest_mm));
  }
  if (volume.values.size() != grid.count())
    throw Error(formatted("{}: {} voxels expected from its size, got {}", what, grid.count(), volume.values.size()));
  if (grid.origin_mm.cwiseAbs().maxCoeff() > kFarthestOrigin_mm)
    throw Error(formatted("{}: the volume begins {:.6g} mm from the origin; expected at most 1 km", what,
                          grid.origin_mm.cwiseAbs().maxCoeff()));
  check_rigid({grid.frame, "grid", grid.direction, grid.origin_mm}, what);
  const auto bad = std::find_if(volume.values.begin(), volume.values.end(), [](float v) { return !std::isfinite(v); });
  if (bad != volume.values.end()) {
    const std::size_t at = std::size_t(bad - volume.values.begin());
    const std::size_t row = std::size_t(grid.size[0]), slice = row * grid.size[1];
    throw Error(
        formatted("{}: voxel ({}, {}, {}) is not a finite number; replace NaN and infinities (with -1000 HU for air)",
                  what, at % row, at % slice / row, at / slice));
  }
}

void check_same_grid(const Grid& field, const Grid& volume) {
  constexpr double kMost_voxels = 0.01;  // files round
  constexpr const char* kRemedy = "; wire the field that was segmented from this volume";
  if (field.frame != volume.frame)
    throw Error("the field is in frame '" + field.frame + "', but the volume in frame '" + volume.frame + "'" +
                kRemedy);
  if (field.size != volume.size)
    throw Error("the field has another size than the volume: " + size_text(field) + ", not " + size_text(volume) +
                " voxels" + kRemedy);
  const double apart_mm = farthest_apart_mm(field, volume);
  if (!(apart_mm <= kMost_voxels * volume.spacing_mm.minCoeff()))
    throw Error(formatted("the field is not where the volume is: voxels of the same index are up to {:.3g} mm apart{}",
                          apart_mm, kRemedy));
}

void check_lies_in(const Mesh& mesh, const Grid& grid, const std::string& what, const std::string& of) {
  constexpr double kLeastShare = 0.5;  // a surface may go on where its CT was cut off
  if (mesh.frame != grid.frame)
    throw Error(what + " is in frame '" + mesh.frame + "', but " + of + " in frame '" + grid.frame +
                "'; give those that belong together");
  const auto inside = std::count_if(mesh.vertices_mm.begin(), mesh.vertices_mm.end(), [&](const Eigen::Vector3d& at) {
    const Eigen::Vector3d index = grid.index_from_point(at);
    const Eigen::Vector3d last(grid.size[0] - 1, grid.size[1] - 1, grid.size[2] - 1);
    return ((index.array() >= -0.5) && (index.array() <= last.array() + 0.5)).all();
  });
  const double share = double(inside) / double(std::max<std::size_t>(1, mesh.vertices_mm.size()));
  if (!(share >= kLeastShare))
    throw Error(formatted("only {:.0f} % of {} lies in {}; give those that belong together", 100 * share, what, of));
}

}  // namespace marrow
