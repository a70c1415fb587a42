// SPDX-License-Identifier: Apache-2.0
#include "marrow/camera/determined.hpp"

#include "marrow/base/error.hpp"
#include "marrow/base/number_text.hpp"

namespace marrow::calibration {

std::string doubtful_focal_length(const Calibration& calibration, const std::string& views) {
  constexpr double kRefused = 0.1, kDoubtful = 0.01;
  for (const int i : {0, 1}) {
    const double focal_px = calibration.intrinsics(i, i), deviation_px = calibration.focal_deviation_px[i];
    if (deviation_px <= kDoubtful * focal_px) continue;
    const std::string text =
        views + formatted(
                    " hardly tell the focal length: it is {:.0f} px, known to {:.0f} px (one standard deviation); take "
                    "the board tilted by 20 degrees or more, to another side in each",
                    focal_px, deviation_px);
    if (!(deviation_px <= kRefused * focal_px)) throw Error(text);
    return text;
  }
  return "";
}

}  // namespace marrow::calibration
