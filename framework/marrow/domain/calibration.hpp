// SPDX-License-Identifier: Apache-2.0
#pragma once
// The calibration of an imaging device. Distortion is removed once, when a view is read, so nodes only get views of an
// ideal pinhole. No projector, cost or edge detector has to handle distortion.
#include <Eigen/Core>
#include <array>
#include <string>

#include "marrow/domain/camera.hpp"

namespace MARROW_EXPORT marrow {

/// Radial distortion about the principal point, in OpenCV's model. An ideal point (x, y), in pixels from the principal
/// point divided by the focal length, is seen at (1 + k_1 r^2 + k_2 r^4 + k_3 r^6) (x, y). A positive k_1 is a
/// pincushion distortion.
struct RadialDistortion {
  std::array<double, 3> k{0, 0, 0};

  double factor(double squared_radius) const {
    return 1 + squared_radius * (k[0] + squared_radius * (k[1] + squared_radius * k[2]));
  }
  bool is_none() const { return k == std::array<double, 3>{0, 0, 0}; }
  using fields = Fields<&RadialDistortion::k>;
};

/// The intrinsic parameters of an imaging device, each with its standard deviation (0 if not known).
struct Calibration {
  int width_px = 0, height_px = 0;
  Eigen::Matrix3d intrinsics = Eigen::Matrix3d::Identity();
  RadialDistortion distortion;
  Eigen::Vector2d focal_deviation_px = Eigen::Vector2d::Zero(), principal_deviation_px = Eigen::Vector2d::Zero();
  std::array<double, 3> distortion_deviation{0, 0, 0};
  double residual_px = 0;  ///< standard deviation of the residuals per coordinate; 0 if not known

  using fields =
      Fields<&Calibration::width_px, &Calibration::height_px, &Calibration::intrinsics, &Calibration::distortion,
             &Calibration::focal_deviation_px, &Calibration::principal_deviation_px, &Calibration::distortion_deviation,
             &Calibration::residual_px>;
};

/// A camera as read from its file: the pinhole model, and the distortion that is still in its images.
struct DistortedCamera {
  Camera camera;
  RadialDistortion distortion;
};

/// Where a pixel of the undistorted image lies in the original image.
Eigen::Vector2d distorted_pixel(const Eigen::Matrix3d& intrinsics, const RadialDistortion& distortion,
                                const Eigen::Vector2d& pixel);

/// Throws Error unless the distorted radius grows with the ideal radius everywhere in the image (so that each point is
/// seen at one place only) and stays below twice the radius of the farthest corner. `what` names the image in the
/// message.
void check_distortion(const Eigen::Matrix3d& intrinsics, const RadialDistortion& distortion, int width_px,
                      int height_px, const std::string& what);

/// Resamples image and mask to what a pinhole with the same camera matrix would have seen. Pixels that lie outside the
/// original image are masked out. Throws Error as check_view() and check_distortion() do.
void remove_distortion(View& view, const RadialDistortion& distortion);

/// The mask of the undistorted image. Each pixel gets the value of the pixel of `original` that is nearest to its place
/// there, or zero if that place is outside.
cv::Mat1b straightened_mask(const cv::Mat1b& original, const Eigen::Matrix3d& intrinsics,
                            const RadialDistortion& distortion);

/// Converts a mask that was drawn on the undistorted image to the original image. straightened_mask() of the result is
/// zero wherever `straight` is zero. Elsewhere it equals `straight`, unless several pixels of `straight` fall on one
/// original pixel and some of them are zero. Throws Error as check_distortion() does.
cv::Mat1b original_mask(const cv::Mat1b& straight, const Eigen::Matrix3d& intrinsics,
                        const RadialDistortion& distortion);

/// Sets the view's camera matrix to that of the calibration and removes the calibration's distortion from the view.
/// Throws Error if the image sizes differ, and as remove_distortion() does.
void apply_calibration(View& view, const Calibration& calibration);

}  // namespace marrow
