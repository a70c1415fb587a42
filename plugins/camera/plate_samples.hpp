// SPDX-License-Identifier: Apache-2.0
#pragma once
// Test data of the suite for cameras: a plate of dots in an image that is bent by a known polynomial.
#include "marrow/domain/image.hpp"
#include "marrow/toolbox/distortion/distortion.hpp"
#include "marrow/toolbox/distortion/plate_points.hpp"

namespace marrow::conformance {

/// Where a point of the straight image is seen: pincushion and S-shape about the middle, 320 x 320 pixels.
Eigen::Vector2d plate_seen_px(const Eigen::Vector2d& ideal_px);
/// Bright dots, 14 px apart, turned by 10 degrees.
Image plate_image();
distortion::PlatePoints plate_points();
/// The exact distortion.
distortion::Distortion plate_distortion();
/// A list of it and of none at all, as at two poses of the arm.
Value plate_distortions();
/// The largest distance between where a distortion and the exact one see a point. The plate's straight image agrees
/// with the original at its middle, as that of a measured distortion does.
double plate_distance_px(const distortion::Distortion& found);

}  // namespace marrow::conformance
