// SPDX-License-Identifier: Apache-2.0
#pragma once
// Where edges may be reported: not at the image's border, nor at a collimator's, nor where the view's mask excludes it.
#include <marrow/domain/camera.hpp>
#include <opencv2/core.hpp>
#include <optional>
#include <vector>

namespace marrow::image {

/// The outline of a round collimator's field: its radius as a function of the direction from its centre. Straightening
/// an image turns a circle into a smooth oval, so the radius has a few harmonics.
struct Field {
  cv::Point2d centre;
  std::vector<double> harmonics;  ///< radius = h[0] + h[1] cos a + h[2] sin a + h[3] cos 2a + h[4] sin 2a + ...
  double radius(double angle) const;
};

/// The field of a round collimator, of which the image holds an arc at least: a circle on which the image is darker
/// outside than inside in most directions that it has within the image, and beyond which most of the corners lie.
/// Nothing where there is none. `grey` is CV_32F, with that largest value.
std::optional<Field> collimator_field(const cv::Mat& grey, double largest);

/// CV_8U, non-zero at the pixels that may be used. Left out are, each with a margin: what View::mask excludes, what
/// lies outside a round collimator's field, black areas that reach three corners of the image, and the image's border.
cv::Mat usable_pixels(const View& view, const cv::Mat& grey, double smallest, double largest, int margin_px);

}  // namespace marrow::image
