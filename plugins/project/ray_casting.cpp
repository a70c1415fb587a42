// SPDX-License-Identifier: Apache-2.0
#include "marrow/project/rays.hpp"

namespace {

using marrow::rays::AttenuationOptions, marrow::rays::RayMotion, marrow::rays::RayProjector, marrow::rays::Span;

struct Options : AttenuationOptions {
  double sample_spacing_mm = 0.5;
};

/// Sums trilinear values at even steps. Each value counts for the step around it.
class RayCastingProjector : public RayProjector {
 public:
  RayCastingProjector(marrow::rays::Attenuation attenuation, double step_mm)
      : RayProjector(std::move(attenuation)), step_mm_(step_mm) {}

  std::optional<marrow::RadiographExpansion> expansion(const marrow::Camera& camera,
                                                       const marrow::RigidTransform& world_from_model,
                                                       const marrow::FragmentFrame& frame,
                                                       const marrow::PixelGrid& grid) const override {
    const RayMotion motion(camera, world_from_model, attenuation_.grid, frame);
    return marrow::rays::expansion_by_rays(motion, grid,
                                           [&](const Eigen::Vector3d& direction) { return change(motion, direction); });
  }

 protected:
  std::shared_ptr<const marrow::RadiographProjector> of(marrow::rays::Attenuation attenuation) const override {
    return std::make_shared<RayCastingProjector>(std::move(attenuation), step_mm_);
  }
  float integral(const Eigen::Vector3d& source, const Eigen::Vector3d& direction) const override {
    const Steps steps = steps_along(source, direction);
    double sum = 0;
    for (int i = steps.first; i <= steps.last; ++i) sum += value(source + i * steps.length * direction);
    return float(sum * step_mm_ * 1e-3);
  }

 private:
  /// The multiples of a step along a ray that may lie where something attenuates. They do not depend on where that is,
  /// so a radiograph changes smoothly with the pose.
  struct Steps {
    double length = 0;  ///< in multiples of the direction vector
    int first = 0, last = -1;
  };
  Steps steps_along(const Eigen::Vector3d& source, const Eigen::Vector3d& direction) const {
    const Span span = marrow::rays::span_in_box(attenuation_.first, attenuation_.last, source, direction, 1);
    if (!(span.from < span.to)) return {};
    const double length = step_mm_ / direction.cwiseProduct(attenuation_.grid.spacing_mm).norm();
    return {length, int(std::ceil(span.from / length)), int(std::floor(span.to / length))};
  }

  RayMotion::Change change(const RayMotion& motion, const Eigen::Vector3d& direction) const {
    const Eigen::Vector3d &source = motion.rays().source, &spacing_mm = attenuation_.grid.spacing_mm;
    const Steps steps = steps_along(source, direction);
    double sum = 0;
    Eigen::Vector3d slopes = Eigen::Vector3d::Zero(), slopes_by_way = Eigen::Vector3d::Zero();
    for (int i = steps.first; i <= steps.last; ++i) {
      const Eigen::Vector3d index = source + i * steps.length * direction, slope = slope_at(index);
      sum += value(index);
      slopes += slope;
      slopes_by_way += i * steps.length * slope;
    }
    // The points keep their distance from the source, so a longer direction vector changes nothing.
    const Eigen::Vector3d along = spacing_mm.cwiseAbs2().cwiseProduct(direction),
                          turning = slopes_by_way - along * (slopes_by_way.dot(direction) / along.dot(direction));
    const double factor = 1e-3 * step_mm_;
    return motion.change(factor * sum, factor * slopes, factor * turning, direction);
  }

  /// The gradient of value(), by the index.
  Eigen::Vector3d slope_at(const Eigen::Vector3d& index) const {
    const int x = int(std::floor(index.x())), y = int(std::floor(index.y())), z = int(std::floor(index.z()));
    const double u = index.x() - x, v = index.y() - y, w = index.z() - z;
    Eigen::Vector3d slope = Eigen::Vector3d::Zero();
    for (int corner = 0; corner < 8; ++corner) {
      const int i = x + (corner & 1), j = y + (corner >> 1 & 1), k = z + (corner >> 2);
      if (!attenuation_.grid.contains(i, j, k)) continue;
      const double a = corner & 1 ? u : 1 - u, b = corner & 2 ? v : 1 - v, c = corner & 4 ? w : 1 - w;
      const double attenuation = attenuation_.thousandths[attenuation_.grid.offset(i, j, k)];
      slope += attenuation * Eigen::Vector3d((corner & 1 ? 1 : -1) * b * c, (corner & 2 ? 1 : -1) * a * c,
                                             (corner & 4 ? 1 : -1) * a * b);
    }
    return slope;
  }

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
      node.summary("Radiographs by ray casting: line integrals as sums of trilinear values at even steps")
          .trait("derivatives"))
      .option("sample_spacing_mm", &Options::sample_spacing_mm,
              "largest distance from one value to the next along a ray", marrow::at_least(0.01));
}
