// SPDX-License-Identifier: Apache-2.0
#pragma once
// The image force of the level set: 1D Gaussian derivatives of the CT along the normal of the front.
#include <algorithm>
#include <cmath>
#include <vector>

#include "marrow/domain/transform.hpp"
#include "marrow/domain/volume.hpp"

namespace level_set {

/// Trilinear value at a fractional index, clamped to the border.
inline float sample(const marrow::Volume& volume, float x, float y, float z) {
  const auto& size = volume.grid.size;
  x = std::clamp(x, 0.f, float(size[0] - 1));
  y = std::clamp(y, 0.f, float(size[1] - 1));
  z = std::clamp(z, 0.f, float(size[2] - 1));
  const int i = std::min(int(x), size[0] - 2), j = std::min(int(y), size[1] - 2), k = std::min(int(z), size[2] - 2);
  const float a = x - float(i), b = y - float(j), c = z - float(k);
  const float* v = volume.values.data() + volume.grid.offset(i, j, k);
  const std::size_t row = std::size_t(size[0]), slice = row * size[1];
  const auto line = [&](std::size_t at) { return v[at] + a * (v[at + 1] - v[at]); };
  const auto plane = [&](std::size_t at) {
    const float first = line(at);
    return first + b * (line(at + row) - first);
  };
  const float first = plane(0);
  return first + c * (plane(slice) - first);
}

/// What the CT shows along a normal.
struct Edge {
  double mean_hu = 0;    ///< smoothed value at the point
  double drop_hu = 0;    ///< height of a step from bright inside to dark outside; negative for the opposite
  double offset_mm = 0;  ///< how far outside the steepest descent the point lies; only where drop_hu > 0
};

class EdgeProfile {
 public:
  /// `sigma_mm` of the Gaussian derivative; `blur_mm`: width (standard deviation) of an ideal edge in the CT itself.
  EdgeProfile(double sigma_mm, double blur_mm)
      : step_mm_(kStep * sigma_mm), variance_mm2_(sigma_mm * sigma_mm + blur_mm * blur_mm) {
    double sum = 0, second_sum = 0, half = 0;
    for (int k = -kReach; k <= kReach; ++k) {
      const double t = k * kStep;  // in sigmas
      weights_[k + kReach][0] = std::exp(-0.5 * t * t);
      sum += weights_[k + kReach][0];
    }
    for (auto& w : weights_) w[0] /= sum;
    for (int k = -kReach; k <= kReach; ++k) {
      const double t = k * kStep;
      auto& w = weights_[k + kReach];
      w[1] = -t / sigma_mm * w[0];
      w[2] = (t * t - 1) / (sigma_mm * sigma_mm) * w[0];
      second_sum += w[2];
      if (k < 0) half += w[1];
    }
    for (auto& w : weights_) w[2] -= second_sum / (2 * kReach + 1);  // a constant has no second derivative
    drop_per_slope_mm_ = 1 / half;
  }

  /// `index`: the point; `normal_index`: 1 mm along the outward normal, in voxels.
  Edge at(const marrow::Volume& volume, const Eigen::Vector3f& index, const Eigen::Vector3f& normal_index) const {
    double mean = 0, slope = 0, bend = 0;
    const Eigen::Vector3f step = normal_index * float(step_mm_);
    Eigen::Vector3f p = index - float(kReach) * step;
    for (const auto& w : weights_) {
      const double value = sample(volume, p.x(), p.y(), p.z());
      mean += w[0] * value;
      slope += w[1] * value;
      bend += w[2] * value;
      p += step;
    }
    // Across a blurred step of width S the second derivative over the (negative) slope is the offset over S^2.
    return {mean, slope * drop_per_slope_mm_, slope > 1e-3 ? variance_mm2_ * bend / slope : 0};
  }

 private:
  static constexpr int kReach = 4;       // samples on either side
  static constexpr double kStep = 0.75;  // in sigmas
  double step_mm_, variance_mm2_, drop_per_slope_mm_ = 1;
  std::array<std::array<double, 3>, 2 * kReach + 1> weights_{};
};

}  // namespace level_set
