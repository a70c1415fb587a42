// SPDX-License-Identifier: Apache-2.0
#pragma once
// Finds the outline of a round bone from its edges.
#include <opencv2/core.hpp>
#include <optional>

#include "marrow/shaft/border.hpp"

namespace marrow::shaft {

/// Distance in pixels, along a border's normal, from the edge pixels of a stretch to the bone's outline. The
/// attenuation of a round bone begins with a vertical tangent at its outline. Blur, by the detector and by the edge
/// extractor, moves its steepest point inwards by about three quarters of the blur's standard deviation. So the profile
/// across the border is fitted with the blurred chord of a cylinder of this width; position and blur are free.
/// std::nullopt if this does not fit: the best position is at the end of the range that is tried (as at a ridge), the
/// attenuation does not increase inwards, or there are too few edge pixels.
std::optional<double> outline_beyond_edges_px(const cv::Mat& image, const EdgeMap& edges, const Border& border,
                                              const Support& support, const Stretch& stretch, double width_px,
                                              double pixel_mm);

}  // namespace marrow::shaft
