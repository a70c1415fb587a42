// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <marrow/domain/features.hpp>
#include <opencv2/core/mat.hpp>

namespace marrow::image {

/// The blur of an image at its edges: the standard deviation in pixels of the Gaussian that would blur a step so much.
/// It is the median over the stronger half of the edges. An edge's blur follows from how much its slope falls when the
/// image is smoothed further (Zhuo and Sim, Pattern Recognition 44(9), 2011). 0 if fewer than 20 edges can be measured.
double blur_px(const cv::Mat& image, const EdgeMap& edges);

/// Distance in pixels by which the steepest place of a round bone's border lies inside its silhouette, if the image is
/// blurred by a Gaussian of this standard deviation. Near the silhouette the path through a round bone grows with the
/// square root of the distance; blurred, its slope is largest 0.765 standard deviations inside.
inline double border_inside_px(double blur_px) { return 0.765 * blur_px; }

}  // namespace marrow::image
