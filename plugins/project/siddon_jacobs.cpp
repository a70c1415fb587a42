// SPDX-License-Identifier: Apache-2.0
#include "marrow/project/rays.hpp"

namespace {

using marrow::rays::AttenuationOptions, marrow::rays::RayProjector, marrow::rays::Span;

/// Exact for voxels of constant attenuation. A ray is followed from one voxel wall to the next. As in Jacobs et al.,
/// the next wall is found by additions.
class SiddonProjector : public RayProjector {
 public:
  using RayProjector::RayProjector;

 protected:
  std::shared_ptr<const marrow::RadiographProjector> of(marrow::rays::Attenuation attenuation) const override {
    return std::make_shared<SiddonProjector>(std::move(attenuation));
  }
  float integral(const Eigen::Vector3d& source, const Eigen::Vector3d& direction) const override {
    const Span span = marrow::rays::span_in_box(attenuation_.first, attenuation_.last, source, direction, 0.5);
    if (!(span.from < span.to)) return 0;
    const marrow::Grid& grid = attenuation_.grid;
    // A voxel extends half a voxel to each side of its centre.
    const Eigen::Vector3d entry = source + (span.from + 1e-9 * (span.to - span.from)) * direction;
    const std::ptrdiff_t strides[3] = {1, grid.size[0], std::ptrdiff_t(grid.size[0]) * grid.size[1]};
    std::ptrdiff_t at = 0;
    double next[3], step[3];
    std::ptrdiff_t move[3];
    for (int k = 0; k < 3; ++k) {
      const int voxel = std::clamp(int(std::floor(entry[k] + 0.5)), attenuation_.first[std::size_t(k)],
                                   attenuation_.last[std::size_t(k)]);
      at += voxel * strides[k];
      const bool forward = direction[k] > 0;
      const bool crosses = std::abs(direction[k]) > 1e-12;
      step[k] = crosses ? 1 / std::abs(direction[k]) : INFINITY;
      next[k] = crosses ? (voxel + (forward ? 0.5 : -0.5) - source[k]) / direction[k] : INFINITY;
      move[k] = forward ? strides[k] : -strides[k];
    }
    const std::int16_t* const values = attenuation_.thousandths.data();
    double sum = 0, here = span.from;
    const double end = span.to - 1e-9 * (span.to - span.from);
    while (here < end) {
      const int axis = next[0] < next[1] ? (next[0] < next[2] ? 0 : 2) : (next[1] < next[2] ? 1 : 2);
      const double wall = std::min(next[axis], span.to);
      sum += (wall - here) * values[at];
      here = wall;
      if (here >= end) break;
      next[axis] += step[axis];
      at += move[axis];
    }
    return float(sum * direction.cwiseProduct(grid.spacing_mm).norm() * 1e-3);
  }
};

std::shared_ptr<const marrow::RadiographProjector> siddon_jacobs(const marrow::Volume& volume,
                                                                 const marrow::SignedField* field,
                                                                 const AttenuationOptions& options) {
  return std::make_shared<SiddonProjector>(attenuation_of(volume, field, options));
}

}  // namespace

MARROW_PLUGIN(plugin) {
  auto node = plugin.node("project.siddon_jacobs", siddon_jacobs);
  marrow::rays::declare<AttenuationOptions>(
      node.summary("Radiographs by exact path lengths through the voxels (Siddon, Med Phys 1985), followed voxel by "
                   "voxel (Jacobs et al., 1998)"));
}
