// SPDX-License-Identifier: Apache-2.0
#pragma once
// What costs that compare points of an outline with edge pixels have in common.
#include <algorithm>
#include <cmath>

#include "marrow/domain/camera.hpp"

namespace marrow::match {

/// Whether a point lies in the image, but not next to its border, where edge detectors find nothing. False for NaN.
inline bool is_away_from_border(const Camera& camera, float u_px, float v_px) {
  constexpr float kMargin_px = 3;
  return u_px >= kMargin_px && v_px >= kMargin_px && u_px <= float(camera.width_px - 1) - kMargin_px &&
         v_px <= float(camera.height_px - 1) - kMargin_px;
}

/// Whether the view's mask excludes a point of the image.
inline bool is_masked(const View& view, float u_px, float v_px) {
  return !view.mask.empty() && !view.mask.at<std::uint8_t>(int(v_px + 0.5f), int(u_px + 0.5f));
}

/// The way from a point of an outline to an edge pixel.
struct WayToEdge {
  float across;  ///< along the outline's normal, positive outwards
  float beyond;  ///< along the outline, to the end of the edge pixel; 0 on an edge without gaps
};
inline WayToEdge way_to_edge(float du_px, float dv_px, float normal_u, float normal_v) {
  constexpr float kOwnLength_px = 1.5f;  // an edge pixel represents this length of the edge on each side
  const float along = std::abs(dv_px * normal_u - du_px * normal_v);
  return {du_px * normal_u + dv_px * normal_v, std::max(0.0f, along - kOwnLength_px)};
}

/// Loss of a distance d: sqrt(s^2 + d^2) - s with s = `scale`. Quadratic near zero, then nearly the distance itself, as
/// in the chapter. Constant from `reach` on. All functions take d^2.
class EdgeLoss {
 public:
  EdgeLoss(double scale, double reach)
      : scale2_(scale * scale), scale_(scale), reach2_(reach * reach), worst_(raw(reach2_)) {}
  double worst() const { return worst_; }
  double operator()(double distance2) const { return distance2 < reach2_ ? raw(distance2) : worst_; }
  /// Derivative by the distance, divided by the distance.
  double weight(double distance2) const { return distance2 < reach2_ ? 1 / std::sqrt(scale2_ + distance2) : 0; }
  /// Second derivative by one coordinate of the distance, whose square is `part2`. At most weight().
  double curvature(double distance2, double part2) const {
    const double sum = scale2_ + distance2;
    return distance2 < reach2_ ? (sum - part2) / (sum * std::sqrt(sum)) : 0;
  }

 private:
  double raw(double distance2) const { return std::sqrt(scale2_ + distance2) - scale_; }
  double scale2_, scale_, reach2_, worst_;
};

}  // namespace marrow::match
