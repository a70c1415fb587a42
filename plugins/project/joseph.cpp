// SPDX-License-Identifier: Apache-2.0
#include <cmath>
#include <marrow/plugin.hpp>

#include "bricks.hpp"
#include "slices.hpp"

namespace {

using marrow::PixelGrid;
using marrow::rays::Attenuation;
using marrow::rays::AttenuationOptions;
using marrow::rays::Bricks;
using marrow::rays::RayProjector;
using marrow::rays::Slices;
using marrow::rays::Span;

// Four numbers that the compiler keeps in one register.
using Four = float __attribute__((vector_size(16)));
using FourVoxels = std::int16_t __attribute__((vector_size(8)));

/// Sums over the slices across the axis that a ray runs along most, bilinear within each.
class JosephProjector : public RayProjector {
 public:
  explicit JosephProjector(Attenuation attenuation) : RayProjector(std::move(attenuation)), slices_(attenuation_), bricks_(attenuation_) {}

  using RayProjector::radiograph;
  std::vector<float> radiograph(const marrow::Camera& camera, const marrow::RigidTransform& world_from_model, const PixelGrid& grid) const override {
    const auto values = slices_.radiograph(marrow::rays::rays_of(camera, world_from_model, attenuation_.grid), grid);
    return values ? *values : RayProjector::radiograph(camera, world_from_model, grid);
  }

 protected:
  float integral(const Eigen::Vector3d& source, const Eigen::Vector3d& direction) const override {
    const Span span = span_in_box(attenuation_, source, direction, 1);
    if (!(span.from < span.to)) return 0;
    const marrow::Grid& grid = attenuation_.grid;
    int across = 0;
    direction.cwiseProduct(grid.spacing_mm).cwiseAbs().maxCoeff(&across);
    const int a = across == 0 ? 1 : 0, b = across == 2 ? 1 : 2;
    const Eigen::Vector3d slope = direction / direction[across];
    const double entry = source[across] + span.from * direction[across], exit = source[across] + span.to * direction[across];
    const int begin = std::max(int(std::ceil(std::min(entry, exit))), attenuation_.first[std::size_t(across)]);
    const int end = std::min(int(std::floor(std::max(entry, exit))), attenuation_.last[std::size_t(across)]);
    const std::uint32_t *slices = bricks_.offsets(across), *columns = bricks_.offsets(a), *rows = bricks_.offsets(b);
    // Counted from where all positions are positive.
    const int left = attenuation_.first[std::size_t(a)] - 3, top = attenuation_.first[std::size_t(b)] - 3;
    const float x = float(source[a] + slope[a] * (begin - source[across]) - left), y = float(source[b] + slope[b] * (begin - source[across]) - top);
    const float dx = float(slope[a]), dy = float(slope[b]);
    columns += left;
    rows += top;
    Four sum{0, 0, 0, 0};
    for (int slice = begin; slice <= end; ++slice) {
      const float px = x + dx * float(slice - begin), py = y + dy * float(slice - begin);
      const int i = int(px), j = int(py);
      const float u = px - float(i), v = py - float(j);
      const std::int16_t *near_row = bricks_.values() + slices[slice] + rows[j], *far_row = bricks_.values() + slices[slice] + rows[j + 1];
      const std::uint32_t c = columns[i], d = columns[i + 1];
      const FourVoxels voxels{near_row[c], near_row[d], far_row[c], far_row[d]};
      const Four across_row{1 - u, u, 1 - u, u}, across_rows{1 - v, 1 - v, v, v};
      sum += across_row * across_rows * __builtin_convertvector(voxels, Four);
    }
    return float(double(sum[0] + sum[1] + sum[2] + sum[3]) * slope.cwiseProduct(grid.spacing_mm).norm() * 1e-3);
  }

 private:
  const Slices slices_;
  const Bricks bricks_;
};

std::shared_ptr<const marrow::Projector> joseph(const marrow::Volume& volume, const marrow::SignedField* field, const AttenuationOptions& options) {
  return std::make_shared<JosephProjector>(attenuation_of(volume, field, options));
}

}  // namespace

MARROW_PLUGIN(plugin) {
  auto node = plugin.node("project.joseph", joseph);
  marrow::rays::declare<AttenuationOptions>(node.summary("Radiographs by Joseph's method (IEEE Trans Med Imaging 1982): a sum over slices, whole images slice by slice"));
}
