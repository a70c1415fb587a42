// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <functional>
#include <list>
#include <memory>
#include <mutex>
#include <string>
#include <vector>

#include "marrow/domain/functions.hpp"
#include "marrow/domain/list.hpp"

namespace marrow::match {

/// The radiograph of a bone together with those of other bones in known poses: line integrals add. The pose that a
/// radiograph is asked for is that of the bone; the others stay where they are. The region holds all of them, and is
/// empty if the bone itself is out of view.
class BonesTogether : public RadiographProjector {
 public:
  using Projector = std::shared_ptr<const RadiographProjector>;
  struct Other {
    std::string name;
    Projector projector;
    RigidTransform world_from_model;
  };
  BonesTogether(Projector bone, std::vector<Other> others) : bone_(std::move(bone)), others_(std::move(others)) {}

  std::vector<float> radiograph(const Camera& camera, const RigidTransform& world_from_model,
                                const PixelGrid& grid) const override;
  std::vector<float> radiograph(const Camera& camera, const RigidTransform& world_from_model,
                                const std::vector<Eigen::Vector2f>& pixels) const override;
  std::optional<RadiographExpansion> expansion(const Camera& camera, const RigidTransform& world_from_model,
                                               const FragmentFrame& frame, const PixelGrid& grid) const override;
  PixelGrid region(const Camera& camera, const RigidTransform& world_from_model) const override;
  /// Null if one of the bones has none.
  Projector smoothed(double sigma_mm) const override;

  /// The same bones, with the others in these poses; a bone that is not in the list stays where it is.
  std::shared_ptr<const BonesTogether> with_others(const List<RigidTransform>& world_from_others) const;
  /// The same bones, each drawn by what `change` makes of its projector. Null if it makes nothing of one.
  std::shared_ptr<const BonesTogether> with_each(
      const std::function<Projector(const RadiographProjector&)>& change) const;

 private:
  /// The others' radiograph for a camera, at every `grid.step_px`-th pixel of the image where it is not 0.
  struct Raster {
    Camera camera;
    PixelGrid grid;
    std::vector<float> values;
  };
  PixelGrid region_of_others(const Camera& camera) const;
  const Raster& raster(const Camera& camera, double step_px) const;
  void add_others(const Camera& camera, const PixelGrid& grid, std::vector<float>& values) const;

  Projector bone_;
  std::vector<Other> others_;
  mutable std::mutex mutex_;
  mutable std::list<Raster> rasters_;  ///< kept, because the others do not move
};

}  // namespace marrow::match
