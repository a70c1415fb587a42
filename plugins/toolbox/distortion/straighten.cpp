// SPDX-License-Identifier: Apache-2.0
#include "marrow/toolbox/distortion/straighten.hpp"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>

#include "catmull_rom.hpp"
#include "marrow/base/error.hpp"
#include "marrow/base/number_text.hpp"

namespace marrow::distortion {
namespace {

void check_size(const cv::Mat& image, const Distortion& distortion, const std::string& what) {
  if (image.cols != distortion.width_px || image.rows != distortion.height_px)
    throw Error(
        formatted("{}: the image has {} x {} pixels, but the distortion is of images of {} x {}; measure it on "
                  "images as they are used, neither cropped nor resized",
                  what, image.cols, image.rows, distortion.width_px, distortion.height_px));
}

/// For each pixel of the straight image its place in the original one; (-1, -1) where there is none.
cv::Mat2f places(const Distortion& distortion) {
  cv::Mat2f map(distortion.height_px, distortion.width_px, cv::Vec2f(-1, -1));
  tbb::parallel_for(0, map.rows, [&](int v) {
    for (int u = 0; u < map.cols; ++u) {
      if (!is_measured(distortion, {u, v})) continue;
      const Eigen::Vector2d seen = seen_pixel(distortion, {u, v});
      if (seen.x() >= 0 && seen.y() >= 0 && seen.x() <= map.cols - 1 && seen.y() <= map.rows - 1)
        map(v, u) = {float(seen.x()), float(seen.y())};
    }
  });
  return map;
}

/// Grey value at a place between pixels. Outside the image, the border pixels are repeated.
float sample(const cv::Mat1f& image, const cv::Vec2f& place) {
  const int u = int(place[0]), v = int(place[1]);
  const auto across = catmull_rom(double(place[0]) - u), down = catmull_rom(double(place[1]) - v);
  double sum = 0;
  for (int j = 0; j < 4; ++j) {
    const float* row = image[std::clamp(v - 1 + j, 0, image.rows - 1)];
    for (int i = 0; i < 4; ++i)
      sum += down[std::size_t(j)] * across[std::size_t(i)] * double(row[std::clamp(u - 1 + i, 0, image.cols - 1)]);
  }
  return float(sum);
}

/// The pixel to which a place belongs, or nullptr if there is none.
template <class Mask>
auto* pixel_at(Mask& mask, const cv::Vec2f& place) {
  return place[0] < 0 ? nullptr : &mask(int(std::lround(place[1])), int(std::lround(place[0])));
}

cv::Mat1b mask_at(const cv::Mat2f& map, const cv::Mat1b& original) {
  cv::Mat1b straight(original.size(), std::uint8_t(0));
  for (int v = 0; v < map.rows; ++v)
    for (int u = 0; u < map.cols; ++u)
      if (const std::uint8_t* pixel = pixel_at(original, map(v, u))) straight(v, u) = *pixel;
  return straight;
}

}  // namespace

void straighten(View& view, const Distortion& distortion) {
  check_view(view);
  const std::string what = "view '" + view.name + "'";
  check_distortion(distortion, what);
  check_size(view.image.pixels, distortion, what);
  const cv::Mat2f map = places(distortion);
  cv::Mat1f taken, grey(map.size(), 0.f);
  view.image.pixels.convertTo(taken, CV_32F);
  tbb::parallel_for(0, map.rows, [&](int v) {
    for (int u = 0; u < map.cols; ++u)
      if (map(v, u)[0] >= 0) grey(v, u) = sample(taken, map(v, u));
  });
  cv::Mat straight;
  grey.convertTo(straight, view.image.pixels.type());  // rounds and saturates
  const cv::Mat1b mask =
      mask_at(map, view.mask.empty() ? cv::Mat1b(map.size(), std::uint8_t(255)) : cv::Mat1b(view.mask));
  view.image.pixels = straight;
  view.mask = mask;
}

cv::Mat1b straightened_mask(const cv::Mat1b& original, const Distortion& distortion) {
  check_distortion(distortion, "the mask");
  check_size(original, distortion, "the mask");
  return mask_at(places(distortion), original);
}

cv::Mat1b original_mask(const cv::Mat1b& straight, const Distortion& distortion) {
  check_distortion(distortion, "the mask");
  check_size(straight, distortion, "the mask");
  const cv::Mat2f map = places(distortion);
  cv::Mat1b original(straight.size(), std::uint8_t(255)), is_known(straight.size(), std::uint8_t(0));
  // An original pixel is zero if any of the pixels that fall on it is zero.
  for (int v = 0; v < map.rows; ++v)
    for (int u = 0; u < map.cols; ++u) {
      std::uint8_t* pixel = pixel_at(original, map(v, u));
      if (!pixel) continue;
      *pixel_at(is_known, map(v, u)) = 255;
      if (straight(v, u) == 0) *pixel = 0;
    }
  // The original pixels on which none falls get the value of the straight pixel that is nearest to their own place.
  tbb::parallel_for(0, original.rows, [&](int v) {
    for (int u = 0; u < original.cols; ++u) {
      if (is_known(v, u)) continue;
      const auto ideal = ideal_pixel(distortion, {u, v});
      if (!ideal) continue;
      const int column = int(std::lround(ideal->x())), row = int(std::lround(ideal->y()));
      if (column < 0 || row < 0 || column >= straight.cols || row >= straight.rows) continue;
      if (straight(row, column) == 0) original(v, u) = 0;
    }
  });
  return original;
}

}  // namespace marrow::distortion
