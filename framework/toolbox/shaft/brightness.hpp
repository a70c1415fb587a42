// SPDX-License-Identifier: Apache-2.0
#pragma once
// What the image says of a pair of borders: bone is darker than what lies beside it, all along.
#include <opencv2/core.hpp>

#include "marrow/toolbox/shaft/border.hpp"

namespace marrow::shaft {

/// Mean grey value inside a pair, and of strips of 3 mm beyond 1 mm outside its borders; infinite outside the image,
/// where nothing contradicts.
struct Brightness {
  double inside = 0, outside_left = 0, outside_right = 0;
};
Brightness brightness_of(const cv::Mat& image, const Border& left, const Border& right, const Stretch& stretch,
                         double pixel_mm);

/// How much brighter it is outside the two borders than inside: of each border the mean step along the stretch,
/// relative to the sum of both sides; of the two the geometric mean, 0 where one is no step.
double step_of(const cv::Mat& image, const Border& left, const Border& right, const Stretch& stretch, double pixel_mm);

/// The longest part of a stretch in which the image darkens across both borders, on either side by at least a part of
/// the step that this image's bone shows. A border of muscle and fat is too faint beside it; and where a bowed bone
/// leaves the line, there is no step at all. Shorter interruptions than `gap_px` do not count. Of zero length where
/// there is none.
Stretch stretch_with_steps(const cv::Mat& image, const Border& left, const Border& right, const Stretch& stretch,
                           double bone_step, double pixel_mm, double gap_px);

}  // namespace marrow::shaft
