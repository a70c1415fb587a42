// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <functional>
#include <list>
#include <memory>
#include <mutex>
#include <string>
#include <vector>

#include "marrow/domain/functions.hpp"

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

/// What a cost is besides a Cost if other bones count in it: their radiographs, or their surfaces. Such a cost is made
/// for known poses of the others, and can be made again for others.
class CostAmongOthers {
 public:
  virtual ~CostAmongOthers() = default;
  /// The same cost at the same level, with the other bones in these poses. Bones are found by their names: a bone that
  /// is not in the list stays where it is, and names that the cost does not know are ignored. Null if the other bones
  /// do not count. The cost refers to what the first one refers to, but not to the first one. Safe to call from several
  /// threads at once.
  virtual std::shared_ptr<const Cost> with_others(const List<RigidTransform>& world_from_others) const = 0;
};

/// with_others() of a cost; null if other bones do not count in it.
inline std::shared_ptr<const Cost> among_others(const Cost& cost, const List<RigidTransform>& world_from_others) {
  const auto* among = dynamic_cast<const CostAmongOthers*>(&cost);
  return among ? among->with_others(world_from_others) : nullptr;
}

}  // namespace marrow::match
