// SPDX-License-Identifier: Apache-2.0
#pragma once
// A simulated X-ray image of a body, and its edges.
#include "marrow/domain/features.hpp"
#include "marrow/domain/functions.hpp"

namespace marrow::analytic {

struct XRay {
  Camera camera;
  double gain = 1, offset = 0;  ///< applied to the line integrals
  double noise = 1;             ///< standard deviation, in half percents of the brightest value; 0: none
  std::uint32_t seed = 0;
};

/// An image of the body in soft tissue: exp(-line integral), with the blur of a device. 16 bit; without noise CV_32F.
View x_ray_view(const XRay& x_ray, const std::string& name, const RadiographProjector& body,
                const RigidTransform& world_from_model);

/// Edges: ridges of the gradient of the line integrals, after the smoothing that edge detectors use.
EdgeMap edges_of(const View& view);

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
