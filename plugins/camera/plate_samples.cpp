// SPDX-License-Identifier: Apache-2.0
#include "plate_samples.hpp"

#include <algorithm>
#include <cmath>

namespace marrow::conformance {
namespace {

constexpr int kSide_px = 320;
constexpr double kOut_px = 6, kTurn_px = -2;  ///< of a point at half the side from the middle

std::vector<Eigen::Vector2d> dots_px() {
  std::vector<Eigen::Vector2d> dots;
  const double step = 14, cosine = std::cos(0.1745), sine = std::sin(0.1745);
  for (int row = -14; row <= 14; ++row)
    for (int column = -14; column <= 14; ++column) {
      const Eigen::Vector2d at(162 + step * (cosine * column - sine * row),
                               157 + step * (sine * column + cosine * row));
      if ((at.array() > 12).all() && (at.array() < kSide_px - 12).all()) dots.push_back(at);
    }
  return dots;
}

}  // namespace

Eigen::Vector2d plate_seen_px(const Eigen::Vector2d& ideal_px) {
  const Eigen::Vector2d off = (ideal_px.array() - 0.5 * (kSide_px - 1)) / (0.5 * kSide_px);
  return ideal_px + off.squaredNorm() * (kOut_px * off + kTurn_px * Eigen::Vector2d(-off.y(), off.x()));
}

Image plate_image() {
  cv::Mat image(kSide_px, kSide_px, CV_16U, cv::Scalar(9000));
  for (const Eigen::Vector2d& dot : dots_px()) {
    const Eigen::Vector2d at = plate_seen_px(dot);
    for (int v = std::max(0, int(at.y()) - 9); v <= std::min(kSide_px - 1, int(at.y()) + 9); ++v)
      for (int u = std::max(0, int(at.x()) - 9); u <= std::min(kSide_px - 1, int(at.x()) + 9); ++u) {
        const double squared = (Eigen::Vector2d(u, v) - at).squaredNorm();
        image.at<std::uint16_t>(v, u) = std::uint16_t(image.at<std::uint16_t>(v, u) + 8000 * std::exp(-squared / 8));
      }
  }
  return {image};
}

distortion::PlatePoints plate_points() {
  distortion::PlatePoints points{kSide_px, kSide_px, {}, {}, {}};
  for (const Eigen::Vector2d& dot : dots_px()) points.add(dot, plate_seen_px(dot));
  return points;
}

distortion::Distortion plate_distortion() {
  distortion::Distortion exact;
  exact.width_px = exact.height_px = kSide_px;
  exact.degree = 3;
  exact.terms_px.assign(distortion::terms_of(3), Eigen::Vector2d::Zero());
  exact.terms_px[6] = exact.terms_px[8] = {kOut_px, kTurn_px};
  exact.terms_px[7] = exact.terms_px[9] = {-kTurn_px, kOut_px};
  exact.area_px = {{10, 10}, {310, 10}, {310, 310}, {10, 310}};
  return exact;
}

marrow::Value plate_distortions() {
  List<distortion::Distortion> list;
  list.add("first", plate_distortion());
  distortion::Distortion none = plate_distortion();
  none.terms_px.assign(none.terms_px.size(), Eigen::Vector2d::Zero());
  list.add("second", none);
  return marrow::Value::of<distortion::Distortion>(list, "view");
}

double plate_distance_px(const distortion::Distortion& found) {
  double worst = 0;
  for (int v = 30; v <= 290; v += 20)
    for (int u = 30; u <= 290; u += 20)
      worst = std::max(worst, (seen_pixel(found, Eigen::Vector2d(u, v)) - plate_seen_px({u, v})).norm());
  return worst;
}

}  // namespace marrow::conformance
