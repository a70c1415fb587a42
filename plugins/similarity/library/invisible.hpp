// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "marrow/domain/functions.hpp"

namespace marrow::analytic {

/// Draws nothing in its region of an image, as a surface whose triangles face inwards has no outline.
class InvisibleProjector : public OutlineProjector, public RadiographProjector {
 public:
  explicit InvisibleProjector(const PixelGrid& region) : region_(region) {}
  std::vector<OutlinePoint> outline(const Camera&, const RigidTransform&, double) const override { return {}; }
  std::vector<float> radiograph(const Camera&, const RigidTransform&, const PixelGrid& grid) const override {
    return std::vector<float>(grid.count());
  }
  std::vector<float> radiograph(const Camera&, const RigidTransform&,
                                const std::vector<Eigen::Vector2f>& pixels) const override {
    return std::vector<float>(pixels.size());
  }
  PixelGrid region(const Camera&, const RigidTransform&) const override { return region_; }

 private:
  PixelGrid region_;
};

}  // namespace marrow::analytic
