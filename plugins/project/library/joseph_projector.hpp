// SPDX-License-Identifier: Apache-2.0
#pragma once
#define TBB_PREVIEW_COLLABORATIVE_CALL_ONCE 1
#include <tbb/collaborative_call_once.h>

#include <memory>
#include <optional>
#include <utility>

#include "marrow/project/bricks.hpp"
#include "marrow/project/slices.hpp"

namespace marrow::rays {

/// Sums of bilinear values over the slices that are perpendicular to the axis nearest to the ray's direction.
class JosephProjector : public RayProjector {
 public:
  explicit JosephProjector(Attenuation attenuation) : RayProjector(std::move(attenuation)), slices_(attenuation_) {}

  using RayProjector::radiograph;
  std::vector<float> radiograph(const Camera& camera, const RigidTransform& world_from_model,
                                const PixelGrid& grid) const override {
    const auto values = slices_.radiograph(rays_of(camera, world_from_model, attenuation_.grid), grid);
    return values ? *values : RayProjector::radiograph(camera, world_from_model, grid);
  }

  std::optional<RadiographExpansion> expansion(const Camera& camera, const RigidTransform& world_from_model,
                                               const FragmentFrame& frame, const PixelGrid& grid) const override {
    const RayMotion motion(camera, world_from_model, attenuation_.grid, frame);
    if (auto expansion = slices_.expansion(motion, grid)) return expansion;
    return expansion_by_rays(motion, grid,
                             [&](const Eigen::Vector3d& direction) { return bricks().change(motion, direction); });
  }

 protected:
  std::shared_ptr<const RadiographProjector> of(Attenuation attenuation) const override {
    return std::make_shared<JosephProjector>(std::move(attenuation));
  }
  float integral(const Eigen::Vector3d& source, const Eigen::Vector3d& direction) const override {
    return bricks().integral(source, direction);
  }

 private:
  /// Made for the first ray that needs them: whole images do without.
  const Bricks& bricks() const {
    tbb::collaborative_call_once(has_bricks_, [&] { bricks_.emplace(attenuation_); });
    return *bricks_;
  }

  const Slices slices_;
  mutable tbb::collaborative_once_flag has_bricks_;
  mutable std::optional<Bricks> bricks_;
};

}  // namespace marrow::rays
