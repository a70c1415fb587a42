// SPDX-License-Identifier: Apache-2.0
#pragma once
// A simulated X-ray image of a body, and its edges.
#include "marrow/domain/camera.hpp"
#include "marrow/domain/features.hpp"
#include "marrow/domain/functions.hpp"

namespace marrow::analytic {

struct XRay {
  Camera camera;
  double gain = 1, offset = 0;  ///< of the line integrals
  double noise = 1;             ///< 1: half a percent of the brightest
  std::uint32_t seed = 0;
};

/// The body in soft tissue as a 16-bit image, or of floating point where there is no noise: exp of minus the line
/// integrals, blurred by the device.
View x_ray_view(const XRay& x_ray, const std::string& name, const RadiographProjector& body,
                const RigidTransform& world_from_model);

/// Ridges of the gradient of the logarithm, smoothed as edge detectors do.
EdgeMap edges_of(const View& view);

}  // namespace marrow::analytic
