// SPDX-License-Identifier: Apache-2.0
#pragma once
// From edge pixels to sub-pixel edges.
#include <functional>
#include <marrow/domain/features.hpp>
#include <optional>
#include <vector>

#include "marrow/edges/gradient.hpp"

namespace marrow::edges {

/// Distance along the gradient, in pixels, from the centre of a pixel to the ridge of the gradient's magnitude.
/// std::nullopt if the magnitude has no maximum across the edge. The pixel must not lie on the image's border. A
/// parabola is fitted to the logarithm of the magnitude over 3 x 3 pixels (the facet model of Steger, IEEE TPAMI 1998).
/// A straight step smoothed by a Gaussian has exactly this shape, at any orientation, so its position is unbiased.
std::optional<float> way_to_ridge(const Gradient& gradient, int u, int v);

/// Distance along the gradient, in pixels, from a pixel's centre to an edge, if there is one. Must be safe to call from
/// several threads at once.
using WayToEdge = std::function<std::optional<float>(int u, int v)>;

/// Whether the edge passes through this pixel or just beside it. The pixels that pass form a thin edge without gaps.
bool passes(const Gradient& gradient, std::optional<float> way, int u, int v);

/// Bilinear value of a CV_32F image of at least 2 x 2 pixels. Beyond the border it is extrapolated from the nearest
/// four pixels.
float bilinear(const cv::Mat& values, float u, float v);

/// The edges at sub-pixel positions with the direction and magnitude (grey values per pixel) of the gradient there. At
/// most one for each pixel, in row-major order. `marked` is CV_8U, non-zero at edge pixels. `way` leads to the edge; if
/// it is empty, way_to_ridge() does. An edge without a way stays at its pixel's centre.
EdgeMap refined(const Prepared& image, const Gradient& gradient, const cv::Mat& marked, const WayToEdge& way = {});

}  // namespace marrow::edges
