// SPDX-License-Identifier: Apache-2.0
#pragma once
// Views, and images that are formulas of the pixel.
#include <marrow/domain/camera.hpp>
#include <opencv2/core.hpp>
#include <string>
#include <utility>

#include "shipped.hpp"

namespace marrow::test {

/// formula(u, v) at each pixel.
template <class Pixel, class Formula>
cv::Mat image_of(int width_px, int height_px, const Formula& formula) {
  cv::Mat_<Pixel> image(height_px, width_px);
  for (int v = 0; v < height_px; ++v)
    for (int u = 0; u < width_px; ++u) image(v, u) = Pixel(formula(u, v));
  return image;
}

/// A mask of an image of this size that shows a part of it, or hides it.
inline cv::Mat mask_of(const Camera& camera, const cv::Rect& part, bool is_shown = true) {
  cv::Mat mask(camera.height_px, camera.width_px, CV_8U, cv::Scalar(is_shown ? 0 : 255));
  mask(part).setTo(is_shown ? 255 : 0);
  return mask;
}
inline cv::Mat nothing_shown(const Camera& camera) { return mask_of(camera, {}); }

/// A view with its name, its camera, and an image and a mask if these matter.
inline View view_of(const std::string& name, const Camera& camera, const cv::Mat& pixels = {},
                    const cv::Mat& mask = {}) {
  return {name, {pixels}, camera, mask};
}
/// The same with an even image of 8 bits.
inline View even_view(const std::string& name, const Camera& camera, double grey = 128) {
  return view_of(name, camera, cv::Mat(camera.height_px, camera.width_px, CV_8U, cv::Scalar(grey)));
}

/// Views under their own names.
template <class... Views>
List<View> views_named(const Views&... views) {
  List<View> list;
  (list.add(views.name, views), ...);
  return list;
}
/// Views under their own names, as an input.
template <class... Views>
Value each_view(const Views&... views) {
  return node_test::list(views_named(views...), "view");
}
inline Value each_view(const List<View>& views) { return node_test::list(views, "view"); }

}  // namespace marrow::test
