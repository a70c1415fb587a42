// SPDX-License-Identifier: Apache-2.0
#pragma once
// Pixels that show the patient: not at the border of the image or of a collimator, and only where the view's
// mask allows it.
#include <marrow/domain/camera.hpp>
#include <opencv2/core.hpp>
#include <optional>
#include <vector>

namespace marrow::image {

/// The outline of a round collimator's field: its radius as a function of the direction from its centre. Removing an
/// image's distortion turns a circle into a smooth oval, so the radius has a few harmonics.
struct Field {
  cv::Point2d centre;
  std::vector<double> harmonics;  ///< radius = h[0] + h[1] cos a + h[2] sin a + h[3] cos 2a + h[4] sin 2a + ...
  double radius(double angle) const;
};

/// The field of a round collimator. The image shows at least an arc of its outline, a circle that leaves at least three
/// corners of the image outside. In most directions in which the outline lies within the image, the image is darker
/// outside than inside. std::nullopt if there is no such circle. `grey`: CV_32F; `largest`: its largest value.
std::optional<Field> collimator_field(const cv::Mat& grey, double largest);

/// CV_8U, non-zero at the usable pixels. A margin is left around pixels that View::mask excludes, pixels outside a
/// round collimator's field, black areas that reach three corners, and the image's border.
cv::Mat usable_pixels(const View& view, const cv::Mat& grey, double smallest, double largest, int margin_px);

}  // namespace marrow::image
