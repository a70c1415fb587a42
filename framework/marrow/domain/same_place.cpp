// SPDX-License-Identifier: Apache-2.0
#include "marrow/domain/same_place.hpp"

#include <algorithm>

#include "marrow/base/error.hpp"
#include "marrow/base/number_text.hpp"

namespace marrow {
namespace {

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
