// SPDX-License-Identifier: Apache-2.0
#pragma once
// An image intensifier that bends its images, and what it shows of a plate with holes or dots. The exact truth for
// tests of calibrations: it is no polynomial, and shares no code with them.
#include <Eigen/Core>
#include <cstdint>

#include "marrow/domain/image.hpp"
#include "marrow/toolbox/distortion/plate_points.hpp"

namespace marrow::simulate {

/// The exact distortion. A point at an ideal pixel is seen at seen_px(). Its curved face moves a point at the distance
/// r from its middle outwards to rho tan(r / rho), and the earth's magnetic field turns it about the middle, the rim by
/// `turn_rad` more than the middle. Iron nearby shifts what is near `iron_px`.
struct Intensifier {
  Eigen::Vector2d middle_px = Eigen::Vector2d::Zero();
  double rim_px = 470;
  double pincushion_px = 20;  ///< by how much the rim is moved outwards; less than a third of rim_px
  double turn_rad = 0;        ///< positive is clockwise on the screen
  Eigen::Vector2d shift_px = Eigen::Vector2d::Zero();
  Eigen::Vector2d iron_px = Eigen::Vector2d::Zero();
  double iron_shift_px = 0;

  Eigen::Vector2d seen_px(const Eigen::Vector2d& ideal_px) const;
};

/// The plate and how it is seen.
struct PlateScene {
  int width_px = 1024, height_px = 1024;
  bool is_hexagonal = false, has_bright_dots = true;
  double spacing_mm = 4.4, dot_mm = 1.9;
  double plate_transmission = 0.5;  ///< of the plate for bright holes, of a dot for dark ones
  Eigen::Matrix3d ideal_from_plate = Eigen::Matrix3d::Identity();  ///< homography from the plate (mm) to ideal pixels
  double field_px = 470;     ///< radius of the field that the beam reaches, about the image's middle
  double missing_share = 0;  ///< of the dots
  double covered_share = 0;  ///< of the plate, from one side of the field on
  double instrument_px = 0;  ///< width of a dark rod across the image
  double vignetting = 0.3;   ///< by which share the rim of the field is darker
  double unevenness = 0.2;   ///< by which share one side of the image is darker than the other
  double photons = 400;      ///< per pixel in open air; 0: no noise
  double blur_px = 1;
};

/// A 16 bit image of the plate. Noise and missing dots depend only on the seed.
Image image_of_plate(const PlateScene& scene, const Intensifier& intensifier, std::uint64_t seed);

/// Random points of the field: where the straight image shows them, and where they are seen. None of them is a dot.
distortion::PlatePoints true_points(const PlateScene& scene, const Intensifier& intensifier, int count,
                                    std::uint64_t seed);

}  // namespace marrow::simulate
