// SPDX-License-Identifier: Apache-2.0
#pragma once
// What the image says of a pair of borders: bone is darker than what lies beside it, all along.
#include <opencv2/core.hpp>

#include "border.hpp"

namespace marrow::shaft {

/// Mean grey value inside a pair, and of strips of 3 mm beyond 1 mm outside its borders; infinite outside the image,
/// where nothing contradicts.
struct Brightness {
  double inside = 0, outside_left = 0, outside_right = 0;
};
Brightness brightness_of(const cv::Mat& image, const Border& left, const Border& right, const Stretch& stretch,
                         double pixel_mm);

/// The fainter border's mean step of brightness as a fraction of the other's, in a stretch; 0 where one has none.
double balance_of(const cv::Mat& image, const Border& left, const Border& right, const Stretch& stretch,
                  double pixel_mm);

/// The longest part of a stretch in which the image darkens across both borders, on either side by at least a part of
/// what the pair's borders show mostly. A border of muscle and fat is too faint beside one of bone; and where a bowed
/// bone leaves the line, there is no step at all. Shorter interruptions than `gap_px` do not count. Of zero length
/// where there is none.
Stretch stretch_with_steps(const cv::Mat& image, const Border& left, const Border& right, const Stretch& stretch,
                           double pixel_mm, double gap_px);

}  // namespace marrow::shaft
