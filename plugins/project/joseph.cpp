// SPDX-License-Identifier: Apache-2.0
#include <marrow/plugin.hpp>

#include "marrow/project/bricks.hpp"
#include "marrow/project/slices.hpp"

namespace {

using marrow::PixelGrid;
using marrow::rays::Attenuation;
using marrow::rays::AttenuationOptions;
using marrow::rays::Bricks;
using marrow::rays::RayProjector;
using marrow::rays::Slices;

/// Sums of bilinear values over the slices that are perpendicular to the axis nearest to the ray's direction.
class JosephProjector : public RayProjector, public marrow::RadiographDerivatives {
 public:
  explicit JosephProjector(Attenuation attenuation)
      : RayProjector(std::move(attenuation)), slices_(attenuation_), bricks_(attenuation_) {}

  using RayProjector::radiograph;
  std::vector<float> radiograph(const marrow::Camera& camera, const marrow::RigidTransform& world_from_model,
                                const PixelGrid& grid) const override {
    const auto values = slices_.radiograph(marrow::rays::rays_of(camera, world_from_model, attenuation_.grid), grid);
    return values ? *values : RayProjector::radiograph(camera, world_from_model, grid);
  }

  std::optional<marrow::RadiographExpansion> expansion(const marrow::Camera& camera, const marrow::RigidTransform& world_from_model,
                                        const marrow::FragmentFrame& frame, const PixelGrid& grid) const override {
    const marrow::rays::RayMotion motion(camera, world_from_model, attenuation_.grid, frame);
    if (auto expansion = slices_.expansion(motion, grid)) return expansion;
    return marrow::rays::expansion_by_rays(motion, grid, [&](const Eigen::Vector3d& direction) {
      return bricks_.change(motion, direction);
    });
  }

 protected:
  std::shared_ptr<const marrow::RadiographProjector> of(marrow::rays::Attenuation attenuation) const override {
    return std::make_shared<JosephProjector>(std::move(attenuation));
  }
  float integral(const Eigen::Vector3d& source, const Eigen::Vector3d& direction) const override {
    return bricks_.integral(source, direction);
  }

 private:
  const Slices slices_;
  const Bricks bricks_;
};

std::shared_ptr<const marrow::RadiographProjector> joseph(const marrow::Volume& volume,
                                                          const marrow::SignedField* field,
                                                          const AttenuationOptions& options) {
  return std::make_shared<JosephProjector>(attenuation_of(volume, field, options));
}

}  // namespace

MARROW_PLUGIN(plugin) {
  auto node = plugin.node("project.joseph", joseph);
  marrow::rays::declare<AttenuationOptions>(
      node.summary("Radiographs by Joseph's method (IEEE Trans Med Imaging 1982): line integrals as sums over slices; "
                   "whole images are computed slice by slice")
                     .trait("derivatives"));
}
