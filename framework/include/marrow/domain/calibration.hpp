// SPDX-License-Identifier: Apache-2.0
#pragma once
// What a calibration knows of an imaging device. Nodes only ever see plain pinhole views: the distortion is removed
// once, when a view is read, so that no projector, cost or edge detector needs to know of it, and none can forget it.
#include <Eigen/Core>
#include <array>
#include <string>
#include <tuple>

#include "marrow/domain/camera.hpp"

namespace marrow {

/// Radial distortion about the principal point, as OpenCV has it: an ideal point x, y (pixels from the principal point
/// over the focal length) is seen at (1 + k_1 r^2 + k_2 r^4 + k_3 r^6) (x, y). Positive k_1: pincushion.
struct RadialDistortion {
  std::array<double, 3> k{0, 0, 0};

  double factor(double squared_radius) const {
    return 1 + squared_radius * (k[0] + squared_radius * (k[1] + squared_radius * k[2]));
  }
  bool is_none() const { return k == std::array<double, 3>{0, 0, 0}; }
  static constexpr auto fields() { return std::make_tuple(&RadialDistortion::k); }
};

/// The inner parameters of an imaging device, each with one standard deviation where that is known (else 0).
struct Calibration {
  int width_px = 0, height_px = 0;
  Eigen::Matrix3d intrinsics = Eigen::Matrix3d::Identity();
  RadialDistortion distortion;
  Eigen::Vector2d focal_deviation_px = Eigen::Vector2d::Zero(), principal_deviation_px = Eigen::Vector2d::Zero();
  std::array<double, 3> distortion_deviation{0, 0, 0};
  double residual_px = 0;  ///< standard deviation of what is left, per coordinate; 0: not known

  static constexpr auto fields() {
    return std::make_tuple(&Calibration::width_px, &Calibration::height_px, &Calibration::intrinsics,
                           &Calibration::distortion, &Calibration::focal_deviation_px,
                           &Calibration::principal_deviation_px, &Calibration::distortion_deviation,
                           &Calibration::residual_px);
  }
};

/// A camera as its file gives it: the pinhole, and the distortion that the images still have.
struct DistortedCamera {
  Camera camera;
  RadialDistortion distortion;
};

/// Where a pixel of the undistorted image lies in the image as it was taken.
Eigen::Vector2d distorted_pixel(const Eigen::Matrix3d& intrinsics, const RadialDistortion& distortion,
                                const Eigen::Vector2d& pixel);

/// Throws Error unless the distortion grows outwards all over the image, so that each pixel was seen at one place.
void check_distortion(const Eigen::Matrix3d& intrinsics, const RadialDistortion& distortion, int width_px,
                      int height_px, const std::string& what);

/// Resamples image and mask as a pinhole with the same camera matrix would have seen them. Pixels that the image as
/// taken does not show are masked out.
void remove_distortion(View& view, const RadialDistortion& distortion);

/// Takes the camera matrix from the calibration and removes its distortion from the view. Throws Error where sizes
/// disagree.
void apply_calibration(View& view, const Calibration& calibration);

}  // namespace marrow
