// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <array>
#include <optional>
#include <vector>

#include "marrow/domain/functions.hpp"

namespace MARROW_EXPORT marrow {

/// A radiograph and how each of its pixels changes when the model moves.
struct RadiographExpansion {
  std::vector<float> values;  ///< as RadiographProjector::radiograph() gives them
  /// The derivative of each pixel by a small motion m = (r [rad], t [mm]) of the model as defined at Pose: one image
  /// for each of the six. In mm of water per radian, and in mm of water per mm.
  std::array<std::vector<float>, 6> slopes;
};

/// A projector of radiographs that knows their derivatives. It is a second base class of a RadiographProjector, and a
/// caller asks by dynamic_cast whether there are derivatives. Its methods are const and safe to call from several
/// threads at once.
class RadiographDerivatives {
 public:
  virtual ~RadiographDerivatives() = default;
  /// The radiograph at the pixels of a grid, and its derivatives by a small motion of the model in `frame`. They are
  /// the derivatives of the values that are computed, not those of the exact line integrals. Takes about as long as
  /// three radiographs. Absent if a projector that this one is made of knows no derivatives.
  virtual std::optional<RadiographExpansion> expansion(const Camera& camera, const RigidTransform& world_from_model,
                                                       const FragmentFrame& frame, const PixelGrid& grid) const = 0;
};

/// The expansion of any projector; absent if it knows no derivatives.
inline std::optional<RadiographExpansion> expansion_of(const RadiographProjector& projector, const Camera& camera,
                                                       const RigidTransform& world_from_model,
                                                       const FragmentFrame& frame, const PixelGrid& grid) {
  const auto* derivatives = dynamic_cast<const RadiographDerivatives*>(&projector);
  return derivatives ? derivatives->expansion(camera, world_from_model, frame, grid) : std::nullopt;
}

}  // namespace marrow
