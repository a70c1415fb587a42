// SPDX-License-Identifier: Apache-2.0
#include <cmath>
#include <marrow/plugin.hpp>

#include "marrow/project/rays.hpp"

namespace {

using marrow::rays::AttenuationOptions;
using marrow::rays::RayProjector;
using marrow::rays::Span;

struct Options : AttenuationOptions {
  double sample_spacing_mm = 0.5;
};

/// Sums trilinear values at even steps. Each value counts for the step around it.
class RayCastingProjector : public RayProjector {
 public:
  RayCastingProjector(marrow::rays::Attenuation attenuation, double step_mm)
      : RayProjector(std::move(attenuation)), step_mm_(step_mm) {}

 protected:
  std::shared_ptr<const marrow::RadiographProjector> of(marrow::rays::Attenuation attenuation) const override {
    return std::make_shared<RayCastingProjector>(std::move(attenuation), step_mm_);
  }
  float integral(const Eigen::Vector3d& source, const Eigen::Vector3d& direction) const override {
    const Span span = marrow::rays::span_in_box(attenuation_.first, attenuation_.last, source, direction, 1);
    if (!(span.from < span.to)) return 0;
    const double length_mm = (span.to - span.from) * direction.cwiseProduct(attenuation_.grid.spacing_mm).norm();
    const int steps = std::max(1, int(std::ceil(length_mm / step_mm_)));
    const double step = (span.to - span.from) / steps;
    double sum = 0;
    for (int i = 0; i < steps; ++i) sum += value(source + (span.from + (i + 0.5) * step) * direction);
    return float(sum * length_mm / steps * 1e-3);
  }

 private:
  float value(const Eigen::Vector3d& index) const {
    const auto& size = attenuation_.grid.size;
    const int x = int(std::floor(index.x())), y = int(std::floor(index.y())), z = int(std::floor(index.z()));
    const float u = float(index.x() - x), v = float(index.y() - y), w = float(index.z() - z);
    const std::size_t row = std::size_t(size[0]), plane = row * std::size_t(size[1]);
    const std::int16_t* const values = attenuation_.thousandths.data();
    if (x >= 0 && y >= 0 && z >= 0 && x + 1 < size[0] && y + 1 < size[1] && z + 1 < size[2]) {
      const std::int16_t* const at = values + std::size_t(z) * plane + std::size_t(y) * row + std::size_t(x);
      const auto across = [&](const std::int16_t* p) {
        return (1 - v) * ((1 - u) * p[0] + u * p[1]) + v * ((1 - u) * p[row] + u * p[row + 1]);
      };
      return (1 - w) * across(at) + w * across(at + plane);
    }
    float sum = 0;
    for (int corner = 0; corner < 8; ++corner) {
      const int i = x + (corner & 1), j = y + (corner >> 1 & 1), k = z + (corner >> 2);
      if (!attenuation_.grid.contains(i, j, k)) continue;
      sum += (corner & 1 ? u : 1 - u) * (corner & 2 ? v : 1 - v) * (corner & 4 ? w : 1 - w) *
             float(values[attenuation_.grid.offset(i, j, k)]);
    }
    return sum;
  }

  const double step_mm_;
};

std::shared_ptr<const marrow::RadiographProjector> ray_casting(const marrow::Volume& volume,
                                                               const marrow::SignedField* field,
                                                               const Options& options) {
  return std::make_shared<RayCastingProjector>(attenuation_of(volume, field, options), options.sample_spacing_mm);
}

}  // namespace

MARROW_PLUGIN(plugin) {
  auto node = plugin.node("project.ray_casting", ray_casting);
  marrow::rays::declare<Options>(
      node.summary("Radiographs by ray casting: line integrals as sums of trilinear values at even steps"))
      .option("sample_spacing_mm", &Options::sample_spacing_mm,
              "largest distance from one value to the next along a ray", marrow::at_least(0.01));
}
