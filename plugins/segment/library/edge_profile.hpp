// SPDX-License-Identifier: Apache-2.0
#pragma once
// The image force of the level set: 1D Gaussian derivatives of the CT along the normal of the front.
#include <algorithm>
#include <cmath>
#include <vector>

#include "marrow/domain/transform.hpp"
#include "marrow/domain/volume.hpp"

namespace marrow::segment {

/// Trilinear value at a fractional index, clamped to the border. The volume must have at least two voxels along each
/// axis.
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
  double drop_hu = 0;    ///< height of a step from bright inside to dark outside; negative for the opposite step
  double offset_mm = 0;  ///< distance of the point outside the steepest descent; 0 if there is no descent
};

class EdgeProfile {
 public:
  /// `sigma_mm`: standard deviation of the Gaussian derivative. `blur_mm`: standard deviation of the CT's own blur of
  /// an ideal edge. `cortex_hu`: value assumed for a cortex that is too thin for the CT to show its true value.
  EdgeProfile(double sigma_mm, double blur_mm, double cortex_hu)
      : step_mm_(kStep * sigma_mm), variance_mm2_(sigma_mm * sigma_mm + blur_mm * blur_mm), cortex_hu_(cortex_hu) {
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

  /// `index`: the point, as a fractional index. `normal_index`: 1 mm along the outward normal, in voxels.
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
    // For a step with blur S: second derivative / -(first derivative) = offset / S^2. `slope` is the negated first
    // derivative.
    return {mean, slope * drop_per_slope_mm_, slope > 1e-3 ? variance_mm2_ * bend / slope : 0};
  }

  /// Distance in mm from the true surface of a thin cortex to the edge that at() sees. Blur moves this edge outwards. A
  /// point on the true surface has offset_mm = -shift. 0 where the cortex is thick enough or not found.
  /// The CT shows more than a step from spongy bone to tissue would. This excess and the cortex's density give the
  /// cortex's thickness (after Treece, Gee, Mayhew and Poole, Med. Image Anal. 2010).
  /// `index`: a point on the surface; `normal_index` as in at().
  double thin_cortex_shift_mm(const marrow::Volume& volume, const Eigen::Vector3f& index,
                              const Eigen::Vector3f& normal_index) const {
    constexpr double kStep_mm = 0.5;
    double spongy = 0, tissue = 0, brightest = -1e9, sum = 0;
    for (int k = -8; k <= 7; ++k) {
      const Eigen::Vector3f p = index + float((k + 0.5) * kStep_mm) * normal_index;
      const double value = sample(volume, p.x(), p.y(), p.z());
      if (k < -5)
        spongy += value / 3;
      else if (k > 4)
        tissue += value / 3;
      else
        sum += value, brightest = std::max(brightest, value);
    }
    const double cortex = std::max(cortex_hu_, brightest), light = (sum - 5 * spongy - 5 * tissue) * kStep_mm;
    const double is_thin =
        std::clamp(((brightest - spongy) / std::max(brightest - tissue, 1.0) - 0.15) / 0.15, 0.0, 1.0);
    if (is_thin == 0 || light <= 0 || spongy - tissue < 50 || cortex - spongy < 100) return 0;
    // A cortex of thickness k s lies between tissue outside and spongy bone inside. With blur s and e = exp(-k^2 / 2),
    // its surface has the slope -((cortex - tissue) - (cortex - spongy) e) / s and the second derivative
    // -(cortex - spongy) k e / s^2, both divided by sqrt(2 pi). at() computes the offset from these two.
    const double s = std::sqrt(variance_mm2_), k = light / (cortex - spongy) / s,
                 part = (cortex - spongy) / (cortex - tissue);
    const double e = std::exp(-0.5 * k * k);
    return is_thin * s * std::min(part * k * e / (1 - part * e), 1.5);
  }

 private:
  static constexpr int kReach = 4;       // samples on either side
  static constexpr double kStep = 0.75;  // in sigmas
  double step_mm_, variance_mm2_, cortex_hu_, drop_per_slope_mm_ = 1;
  std::array<std::array<double, 3>, 2 * kReach + 1> weights_{};
};

}  // namespace marrow::segment
