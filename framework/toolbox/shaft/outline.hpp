// SPDX-License-Identifier: Apache-2.0
#pragma once
// Where the outline of a round bone is, of which only the edges were found.
#include <opencv2/core.hpp>
#include <optional>

#include "marrow/toolbox/shaft/border.hpp"

namespace marrow::shaft {

/// How far, in the direction of a border's normal, the bone's outline lies from the edge pixels of a stretch. The
/// attenuation of a round bone sets in with a vertical tangent; blurred, by the detector and by the edge extractor
/// itself, it is steepest about three quarters of the blur's deviation further inside. The profile across the border is
/// fitted with the blurred chord of a cylinder of that diameter, whose place and blur are free. Nothing where that does
/// not fit: the best place is the farthest that is tried, as at a ridge, or there is no more attenuation inside.
std::optional<double> outline_beyond_edges_px(const cv::Mat& image, const EdgeMap& edges, const Border& border,
                                              const Support& support, const Stretch& stretch, double width_px,
                                              double pixel_mm);

}  // namespace marrow::shaft
