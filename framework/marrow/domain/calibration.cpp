// SPDX-License-Identifier: Apache-2.0
#include "marrow/domain/calibration.hpp"

#include <tbb/parallel_for.h>

#include <Eigen/LU>
#include <algorithm>
#include <cmath>

#include "marrow/base/error.hpp"
#include "marrow/base/number_text.hpp"

namespace marrow {
namespace {

/// Squared distance of the farthest image corner from the principal point, divided by the squared focal length.
double largest_squared_radius(const Eigen::Matrix3d& inverse, int width_px, int height_px) {
  double largest = 0;
  for (const double u : {0.0, width_px - 1.0})
    for (const double v : {0.0, height_px - 1.0})
      largest = std::max(largest, (inverse * Eigen::Vector3d(u, v, 1)).head<2>().squaredNorm());
  return largest;
}

/// Weights of four samples for a position `t` after the second one: Keys' cubic convolution with a = -1/2 (IEEE Trans.
/// ASSP 1981), which is exact for parabolas. OpenCV uses a = -3/4, which is not exact for them, and rounds positions to
/// 1/32 pixel.
std::array<double, 4> cubic_weights(double t) {
  return {t * (-0.5 + t * (1 - 0.5 * t)), 1 + t * t * (-2.5 + 1.5 * t), t * (0.5 + t * (2 - 1.5 * t)),
          t * t * (-0.5 + 0.5 * t)};
}

/// Grey value at a position between pixels. Outside the image, the border pixels are repeated.
double sample_cubic(const cv::Mat1f& image, const Eigen::Vector2d& at) {
  const int u = int(std::floor(at.x())), v = int(std::floor(at.y()));
  const auto wu = cubic_weights(at.x() - u), wv = cubic_weights(at.y() - v);
  double sum = 0;
  for (int row = 0; row < 4; ++row) {
    const float* line = image[std::clamp(v - 1 + row, 0, image.rows - 1)];
    for (int column = 0; column < 4; ++column)
      sum +=
          wv[std::size_t(row)] * wu[std::size_t(column)] * double(line[std::clamp(u - 1 + column, 0, image.cols - 1)]);
  }
  return sum;
}

/// Whether the place lies between the centres of the first and the last pixels.
bool is_inside(const Eigen::Vector2d& at, const cv::Mat& image) {
  return at.x() >= 0 && at.y() >= 0 && at.x() <= image.cols - 1 && at.y() <= image.rows - 1;
}

/// The inverse of distorted_pixel(), for places in an image that check_distortion() accepts. The distorted radius grows
/// with the ideal one up to `largest_radius`; a place that is seen from farther away gives one outside the image.
Eigen::Vector2d ideal_pixel(const Eigen::Matrix3d& intrinsics, const RadialDistortion& distortion,
                            double largest_radius, const Eigen::Vector2d& pixel) {
  constexpr int kHalvings = 40;
  Eigen::Vector3d seen = intrinsics.inverse() * pixel.homogeneous();
  const double radius = seen.head<2>().norm();
  if (radius == 0) return pixel;
  double low = 0, high = largest_radius;
  for (int i = 0; i < kHalvings; ++i) {
    const double middle = 0.5 * (low + high);
    (middle * distortion.factor(middle * middle) < radius ? low : high) = middle;
  }
  if (low >= largest_radius * (1 - 1e-9)) return {-1, -1};
  seen.head<2>() *= 0.5 * (low + high) / radius;
  return (intrinsics * seen).head<2>();
}

/// The pixel that a place inside an image belongs to.
template <class Mask>
auto& nearest(Mask& mask, const Eigen::Vector2d& at) {
  return mask(int(std::lround(at.y())), int(std::lround(at.x())));
}

}  // namespace

Eigen::Vector2d distorted_pixel(const Eigen::Matrix3d& intrinsics, const RadialDistortion& distortion,
                                const Eigen::Vector2d& pixel) {
  Eigen::Vector3d ideal = intrinsics.inverse() * pixel.homogeneous();
  ideal.head<2>() *= distortion.factor(ideal.head<2>().squaredNorm());
  return (intrinsics * ideal).head<2>();
}

void check_distortion(const Eigen::Matrix3d& intrinsics, const RadialDistortion& distortion, int width_px,
                      int height_px, const std::string& what) {
  const double largest = largest_squared_radius(intrinsics.inverse(), width_px, height_px);
  constexpr int kSteps = 256;
  double before = 0;
  for (int i = 1; i <= kSteps; ++i) {
    const double radius = std::sqrt(largest) * i / kSteps, seen = radius * distortion.factor(radius * radius);
    if (!(seen > before) || !(seen < 2 * std::sqrt(largest)))
      throw Error(
          formatted("{}: the radial distortion folds the image or more than doubles it, {} % of the way to its corner; "
                    "check that its terms are of normalised coordinates (pixels from the principal point over the "
                    "focal length), as OpenCV gives them",
                    what, int(100.0 * i / kSteps)));
    before = seen;
  }
}

void remove_distortion(View& view, const RadialDistortion& distortion) {
  check_view(view);
  const Camera& camera = view.camera;
  check_distortion(camera.intrinsics, distortion, camera.width_px, camera.height_px, "view '" + view.name + "'");
  cv::Mat1f taken, straight(camera.height_px, camera.width_px, 0.f);
  view.image.pixels.convertTo(taken, CV_32F);
  const cv::Mat1b own_mask =
      view.mask.empty() ? cv::Mat1b(camera.height_px, camera.width_px, std::uint8_t(255)) : cv::Mat1b(view.mask);
  tbb::parallel_for(0, camera.height_px, [&](int v) {
    for (int u = 0; u < camera.width_px; ++u) {
      const Eigen::Vector2d seen = distorted_pixel(camera.intrinsics, distortion, {u, v});
      if (is_inside(seen, taken)) straight(v, u) = float(sample_cubic(taken, seen));
    }
  });
  cv::Mat pixels;
  straight.convertTo(pixels, view.image.pixels.type());  // rounds and saturates
  view.image.pixels = pixels;
  const cv::Mat1b mask = straightened_mask(own_mask, camera.intrinsics, distortion);
  if (!view.mask.empty() || cv::countNonZero(mask) < mask.rows * mask.cols) view.mask = mask;
}

cv::Mat1b straightened_mask(const cv::Mat1b& original, const Eigen::Matrix3d& intrinsics,
                            const RadialDistortion& distortion) {
  cv::Mat1b straight(original.size(), std::uint8_t(0));
  tbb::parallel_for(0, original.rows, [&](int v) {
    for (int u = 0; u < original.cols; ++u) {
      const Eigen::Vector2d seen = distorted_pixel(intrinsics, distortion, {u, v});
      if (is_inside(seen, original)) straight(v, u) = nearest(original, seen);
    }
  });
  return straight;
}

cv::Mat1b original_mask(const cv::Mat1b& straight, const Eigen::Matrix3d& intrinsics,
                        const RadialDistortion& distortion) {
  check_distortion(intrinsics, distortion, straight.cols, straight.rows, "the mask");
  const double radius = std::sqrt(largest_squared_radius(intrinsics.inverse(), straight.cols, straight.rows));
  cv::Mat1b original(straight.size(), std::uint8_t(255)), is_known(straight.size(), std::uint8_t(0));
  // An original pixel is zero if any of the pixels that fall on it is zero.
  for (int v = 0; v < straight.rows; ++v)
    for (int u = 0; u < straight.cols; ++u) {
      const Eigen::Vector2d seen = distorted_pixel(intrinsics, distortion, {u, v});
      if (!is_inside(seen, original)) continue;
      nearest(is_known, seen) = 255;
      if (straight(v, u) == 0) nearest(original, seen) = 0;
    }
  // The original pixels on which none falls get the value of a neighbour.
  tbb::parallel_for(0, straight.rows, [&](int v) {
    for (int u = 0; u < straight.cols; ++u) {
      if (is_known(v, u)) continue;
      const Eigen::Vector2d ideal = ideal_pixel(intrinsics, distortion, radius, {u, v});
      if (!is_inside(ideal, straight)) continue;
      const Eigen::Vector2d seen = distorted_pixel(intrinsics, distortion, ideal.array().round());
      if (is_inside(seen, original)) original(v, u) = nearest(original, seen);
    }
  });
  return original;
}

void apply_calibration(View& view, const Calibration& calibration) {
  if (view.image.width() != calibration.width_px || view.image.height() != calibration.height_px)
    throw Error(
        formatted("view '{}': the image has {} x {} pixels, but the calibration is of images of {} x {}; calibrate "
                  "with images as they are used, neither cropped nor resized",
                  view.name, view.image.width(), view.image.height(), calibration.width_px, calibration.height_px));
  view.camera.intrinsics = calibration.intrinsics;
  remove_distortion(view, calibration.distortion);
}

}  // namespace marrow
