// SPDX-License-Identifier: Apache-2.0
#pragma once
// From edge pixels to sub-pixel edges.
#include <functional>
#include <marrow/domain/features.hpp>
#include <optional>
#include <vector>

#include "marrow/toolbox/image/gradient.hpp"

namespace marrow::image {

/// The way along the gradient, in pixels, from the centre of a pixel to the ridge of the gradient's magnitude; nothing
/// where the magnitude has no maximum across the edge. The pixel must not lie on the image's border. A parabola is
/// fitted to the logarithm of the magnitude over 3 x 3 pixels (the facet model of Steger, IEEE TPAMI 1998): a straight
/// step smoothed by a Gaussian has exactly this shape, at any orientation, so its position comes out unbiased.
std::optional<float> way_to_ridge(const Gradient& gradient, int u, int v);

/// The way along the gradient, in pixels, from a pixel's centre to an edge, where there is one.
using WayToEdge = std::function<std::optional<float>(int u, int v)>;

/// True where the edge passes through this pixel or just beside it: a thin edge without gaps.
bool passes(const Gradient& gradient, std::optional<float> way, int u, int v);

/// Value between four pixels; beyond the border, of the nearest four.
float bilinear(const cv::Mat& values, float u, float v);

/// Edge pixels at their sub-pixel positions with the gradient there, its magnitude in grey values per pixel; one for
/// each pixel, in row-major order. `marked` is CV_8U, non-zero at edge pixels. The edge is the ridge of the magnitude,
/// unless another way to it is given.
EdgeMap refined(const Prepared& image, const Gradient& gradient, const cv::Mat& marked, const WayToEdge& way = {});

}  // namespace marrow::image
