// SPDX-License-Identifier: Apache-2.0
#include "marrow/toolbox/distortion/arm.hpp"

#include <Eigen/QR>
#include <algorithm>
#include <cmath>
#include <opencv2/imgproc.hpp>

#include "marrow/base/error.hpp"
#include "marrow/base/number_text.hpp"

namespace marrow::distortion {
namespace {

using Polygon = std::vector<cv::Point2f>;

Polygon polygon_of(const std::vector<Eigen::Vector2d>& corners) {
  Polygon polygon;
  for (const Eigen::Vector2d& corner : corners) polygon.emplace_back(float(corner.x()), float(corner.y()));
  return polygon;
}

double cubed(double distance) { return distance * distance * distance; }

void check_alike(const Distortion& first, const std::string& first_name, const Distortion& other,
                 const std::string& name) {
  if (first.width_px != other.width_px || first.height_px != other.height_px)
    throw Error(
        formatted("the distortion '{}' is of images of {} x {} pixels, '{}' of {} x {}; one arm has images of "
                  "one size",
                  first_name, first.width_px, first.height_px, name, other.width_px, other.height_px));
  if (!first.lattice_px.empty() && !other.lattice_px.empty() && first.step_px != other.step_px)
    throw Error(
        formatted("the lattice of the distortion '{}' has a step of {} px, that of '{}' of {} px; measure both "
                  "in the same way",
                  first_name, first.step_px, name, other.step_px));
}

}  // namespace

Eigen::VectorXd shares_at(const std::vector<ArmPose>& measured, const ArmPose& pose) {
  const Eigen::Index count = Eigen::Index(measured.size()), trend = pose.size() + 1;
  // Coordinates from the mean, so that the trend that is chosen if several fit has no favourite pose.
  ArmPose mean = ArmPose::Zero(pose.size());
  for (const ArmPose& one : measured) mean += one / double(count);
  double scale = 0;
  for (const ArmPose& one : measured) scale = std::max(scale, (one - mean).cwiseAbs().maxCoeff());
  if (scale == 0) scale = 1;
  const auto terms = [&](const ArmPose& at) {
    Eigen::VectorXd row(trend);
    row << 1, (at - mean) / scale;
    return row;
  };
  Eigen::MatrixXd system = Eigen::MatrixXd::Zero(count + trend, count + trend);
  Eigen::VectorXd right(count + trend);
  for (Eigen::Index i = 0; i < count; ++i) {
    for (Eigen::Index k = 0; k < count; ++k)
      system(i, k) = cubed((measured[std::size_t(i)] - measured[std::size_t(k)]).norm() / scale);
    const Eigen::VectorXd row = terms(measured[std::size_t(i)]);
    system.block(i, count, 1, trend) = row.transpose();
    system.block(count, i, trend, 1) = row;
    right[i] = cubed((pose - measured[std::size_t(i)]).norm() / scale);
  }
  right.tail(trend) = terms(pose);
  // The system is symmetric, so its solution for the pose's own functions gives the shares. Least norm if it is
  // singular.
  return system.completeOrthogonalDecomposition().solve(right).head(count);
}

bool is_between(const std::vector<ArmPose>& measured, const ArmPose& pose) {
  constexpr double kNear = 1e-6;
  if (pose.size() == 1) {
    const auto [low, high] = std::minmax_element(measured.begin(), measured.end(),
                                                 [](const ArmPose& a, const ArmPose& b) { return a[0] < b[0]; });
    return pose[0] >= (*low)[0] - kNear && pose[0] <= (*high)[0] + kNear;
  }
  Polygon places, hull;
  for (const ArmPose& one : measured) places.emplace_back(float(one[0]), float(one[1]));
  cv::convexHull(places, hull);
  return cv::pointPolygonTest(hull, cv::Point2f(float(pose[0]), float(pose[1])), true) >= -1e-4;
}

Distortion mixed(const List<Distortion>& distortions, const Eigen::VectorXd& shares) {
  Distortion sum;
  sum.width_px = distortions[0].width_px;
  sum.height_px = distortions[0].height_px;
  Polygon area = polygon_of(distortions[0].area_px);
  double residual = 0, validated = 0;
  std::size_t with_lattice = 0;
  for (std::size_t i = 0; i < distortions.size(); ++i) {
    const Distortion& one = distortions[i];
    check_alike(distortions[with_lattice], distortions.name(with_lattice), one, distortions.name(i));
    if (!one.lattice_px.empty()) with_lattice = i;
    const double share = shares[Eigen::Index(i)];
    sum.degree = std::max(sum.degree, one.degree);
    sum.terms_px.resize(std::max(sum.terms_px.size(), one.terms_px.size()), Eigen::Vector2d::Zero());
    for (std::size_t k = 0; k < one.terms_px.size(); ++k) sum.terms_px[k] += share * one.terms_px[k];
    sum.lattice_px.resize(std::max(sum.lattice_px.size(), one.lattice_px.size()), Eigen::Vector2d::Zero());
    for (std::size_t k = 0; k < one.lattice_px.size(); ++k) sum.lattice_px[k] += share * one.lattice_px[k];
    if (!one.lattice_px.empty()) sum.step_px = one.step_px;
    residual = std::max(residual, one.residual_px);
    validated = std::max(validated, one.validated_px);
    Polygon common;
    cv::intersectConvexConvex(area, polygon_of(one.area_px), common, true);
    area = common;
  }
  if (area.size() < 3)
    throw Error("no part of the image was measured at all poses of the arm; show more of the plate at each");
  sum.residual_px = residual;
  sum.validated_px = validated;
  for (const cv::Point2f& corner : area) sum.area_px.emplace_back(corner.x, corner.y);
  check_distortion(sum, "the interpolated distortion");
  return sum;
}

}  // namespace marrow::distortion
