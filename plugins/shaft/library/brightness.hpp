// SPDX-License-Identifier: Apache-2.0
#pragma once
// The brightness of the image at a pair of borders: bone is darker than its surroundings along its whole length.
#include <opencv2/core.hpp>

#include "marrow/shaft/border.hpp"

namespace marrow::shaft {

/// Mean grey values inside a pair, and in strips from 1 to 4 mm outside its borders. A region outside the image has the
/// value infinity, which never contradicts bone.
struct Brightness {
  double inside = 0, outside_left = 0, outside_right = 0;
};
Brightness brightness_of(const cv::Mat& image, const Border& left, const Border& right, const Stretch& stretch,
                         double pixel_mm);

/// The step of brightness at a pair of borders. For each border it is the mean of (outside - inside) / (outside +
/// inside) along the stretch, at least 0. The result is the geometric mean of both borders.
double step_of(const cv::Mat& image, const Border& left, const Border& right, const Stretch& stretch, double pixel_mm);

/// The longest part of a stretch in which the image darkens across both borders, each by at least 0.3 of `bone_step`,
/// the step of this image's bone. Borders of muscle and fat are fainter than that. Where a bowed bone leaves the line,
/// there is no step. Interruptions shorter than `gap_px` do not count. The length is 0 if there is no such part.
Stretch stretch_with_steps(const cv::Mat& image, const Border& left, const Border& right, const Stretch& stretch,
                           double bone_step, double pixel_mm, double gap_px);

}  // namespace marrow::shaft
