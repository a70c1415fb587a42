// SPDX-License-Identifier: Apache-2.0
#include <cmath>
#include <marrow/plugin.hpp>

#include "slices.hpp"

namespace {

using marrow::PixelGrid;
using marrow::rays::Attenuation;
using marrow::rays::AttenuationOptions;
using marrow::rays::RayProjector;
using marrow::rays::Slices;
using marrow::rays::Span;

/// One slice, and how it is read between its voxels.
struct Plane {
  std::ptrdiff_t stride_x, stride_y;
  int width, height;

  float value(const std::int16_t* slice, float x, float y) const {
    const int i = int(x + 4) - 4, j = int(y + 4) - 4;  // rounds down, as the ray stays within a voxel of the slice
    const float u = x - float(i), v = y - float(j);
    if (i >= 0 && j >= 0 && i + 1 < width && j + 1 < height) {
      const std::int16_t* const at = slice + i * stride_x + j * stride_y;
      const float a = at[0], b = at[stride_x], c = at[stride_y], d = at[stride_x + stride_y];
      const float near = a + u * (b - a), far = c + u * (d - c);
      return near + v * (far - near);
    }
    const auto voxel = [&](int m, int n) { return m < 0 || n < 0 || m >= width || n >= height ? 0.0f : float(slice[m * stride_x + n * stride_y]); };
    return (1 - v) * ((1 - u) * voxel(i, j) + u * voxel(i + 1, j)) + v * ((1 - u) * voxel(i, j + 1) + u * voxel(i + 1, j + 1));
  }
};

/// Sums over the slices across the axis that a ray runs along most, bilinear within each.
class JosephProjector : public RayProjector {
 public:
  explicit JosephProjector(Attenuation attenuation) : RayProjector(std::move(attenuation)), slices_(attenuation_) {}

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
    const int first = int(std::ceil(std::min(entry, exit))), last = int(std::floor(std::max(entry, exit)));
    const std::ptrdiff_t strides[3] = {1, grid.size[0], std::ptrdiff_t(grid.size[0]) * grid.size[1]};
    const Plane plane{strides[a], strides[b], grid.size[std::size_t(a)], grid.size[std::size_t(b)]};
    // Single precision from the first slice on; the sum itself is exact enough in double.
    const int begin = std::max(first, 0), end = std::min(last, grid.size[std::size_t(across)] - 1);
    const float x = float(source[a] + slope[a] * (begin - source[across])), y = float(source[b] + slope[b] * (begin - source[across]));
    const float dx = float(slope[a]), dy = float(slope[b]);
    const std::int16_t* slice = attenuation_.thousandths.data() + begin * strides[across];
    double sum = 0;
    for (int i = 0; i <= end - begin; ++i, slice += strides[across]) sum += plane.value(slice, x + dx * float(i), y + dy * float(i));
    return float(sum * slope.cwiseProduct(grid.spacing_mm).norm() * 1e-3);
  }

 private:
  const Slices slices_;
};

std::shared_ptr<const marrow::Projector> joseph(const marrow::Volume& volume, const marrow::SignedField* field, const AttenuationOptions& options) {
  return std::make_shared<JosephProjector>(attenuation_of(volume, field, options));
}

}  // namespace

MARROW_PLUGIN(plugin) {
  auto node = plugin.node("project.joseph", joseph);
  marrow::rays::declare<AttenuationOptions>(node.summary("Radiographs by Joseph's method (IEEE Trans Med Imaging 1982): a sum over slices, whole images slice by slice"));
}
