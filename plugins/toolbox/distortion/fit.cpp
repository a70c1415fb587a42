// SPDX-License-Identifier: Apache-2.0
#include "marrow/toolbox/distortion/fit.hpp"

#include <Eigen/LU>
#include <Eigen/QR>
#include <cmath>
#include <numeric>
#include <opencv2/imgproc.hpp>

#include "marrow/base/number_text.hpp"
#include "marrow/domain/random.hpp"

namespace marrow::distortion {
namespace {

constexpr std::size_t kFolds = 5;
constexpr std::size_t kPointsPerTerm = 3;
constexpr std::size_t kNeighbours = 24;

/// The points in use, with their displacements.
struct Samples {
  int width_px, height_px;
  std::vector<Eigen::Vector2d> ideal, displacement;

  Eigen::Vector2d middle() const { return 0.5 * Eigen::Vector2d(width_px - 1, height_px - 1); }
  double half() const { return 0.5 * std::max(width_px, height_px); }
  Polynomial fitted(int degree) const { return fit_polynomial(degree, middle(), half(), ideal, displacement); }
};

Samples samples_of(const PlatePoints& points) {
  Samples samples{points.width_px, points.height_px, {}, {}};
  for (std::size_t i = 0; i < points.used.size(); ++i)
    if (points.used[i]) {
      samples.ideal.push_back(points.ideal_px[i]);
      samples.displacement.push_back(points.seen_px[i] - points.ideal_px[i]);
    }
  return samples;
}

/// The part of a fifth, or everything but this part.
Samples part_of(const Samples& all, std::size_t fold, bool is_left_out) {
  Samples part{all.width_px, all.height_px, {}, {}};
  for (std::size_t i = 0; i < all.ideal.size(); ++i)
    if ((Random(7, i)() % kFolds == fold) == is_left_out) {
      part.ideal.push_back(all.ideal[i]);
      part.displacement.push_back(all.displacement[i]);
    }
  return part;
}

std::vector<Eigen::Vector2d> residuals(const Samples& samples, const Polynomial& fit) {
  std::vector<Eigen::Vector2d> rest;
  for (std::size_t i = 0; i < samples.ideal.size(); ++i)
    rest.push_back(samples.displacement[i] - fit.at(samples.ideal[i]));
  return rest;
}

/// A plane through the residuals of the nearest points, weighted by Cleveland's tricube (J. Am. Stat. Assoc. 1979,
/// section 2), at `place`. The plane's prior is zero, so that it does not run away where all points lie on one side.
Eigen::Vector2d local_rest(const std::vector<Eigen::Vector2d>& places, const std::vector<Eigen::Vector2d>& rest,
                           const Eigen::Vector2d& place) {
  std::vector<std::pair<double, std::size_t>> nearest;
  for (std::size_t i = 0; i < places.size(); ++i) nearest.emplace_back((places[i] - place).squaredNorm(), i);
  const std::size_t count = std::min(kNeighbours, nearest.size());
  std::partial_sort(nearest.begin(), nearest.begin() + std::ptrdiff_t(count), nearest.end());
  const double reach = std::sqrt(nearest[count - 1].first) * 1.0001;
  Eigen::Matrix3d normal = Eigen::Vector3d(0.5, 0.5, 0.5).asDiagonal();
  Eigen::Matrix<double, 3, 2> right = Eigen::Matrix<double, 3, 2>::Zero();
  for (std::size_t n = 0; n < count; ++n) {
    const double share = std::sqrt(nearest[n].first) / reach;
    const double weight = std::pow(1 - share * share * share, 3);
    const Eigen::Vector2d off = (places[nearest[n].second] - place) / reach;
    const Eigen::Vector3d row(1, off.x(), off.y());
    normal += weight * row * row.transpose();
    right += weight * row * rest[nearest[n].second].transpose();
  }
  return (normal.inverse() * right).row(0).transpose();
}

/// Root mean square distance of points from fits that did not see them.
double validated(const Samples& all, int degree, bool is_local) {
  double squares = 0;
  for (std::size_t fold = 0; fold < kFolds; ++fold) {
    const Samples seen = part_of(all, fold, false), left_out = part_of(all, fold, true);
    const Polynomial fit = seen.fitted(degree);
    const std::vector<Eigen::Vector2d> rest = residuals(seen, fit), errors = residuals(left_out, fit);
    for (std::size_t i = 0; i < errors.size(); ++i)
      squares +=
          (is_local ? errors[i] - local_rest(seen.ideal, rest, left_out.ideal[i]) : errors[i]).eval().squaredNorm();
  }
  return std::sqrt(squares / double(all.ideal.size()));
}

void put_lattice(const Samples& samples, const std::vector<Eigen::Vector2d>& rest, Distortion& distortion) {
  distortion.step_px = lattice_step_px(distortion.width_px, distortion.height_px);
  for (int row = 0; row < lattice_rows(distortion); ++row)
    for (int column = 0; column < lattice_columns(distortion); ++column)
      distortion.lattice_px.push_back(
          local_rest(samples.ideal, rest, distortion.step_px * Eigen::Vector2d(column, row)));
}

/// The convex hull of the points and of what lies within the margin of them.
std::vector<Eigen::Vector2d> area_of(const std::vector<Eigen::Vector2d>& ideal, double margin_px) {
  std::vector<cv::Point2f> around, hull;
  for (const Eigen::Vector2d& at : ideal)
    for (int i = 0; i < (margin_px > 0 ? 8 : 1); ++i)
      around.emplace_back(float(at.x() + margin_px * std::cos(kPi * i / 4)),
                          float(at.y() + margin_px * std::sin(kPi * i / 4)));
  cv::convexHull(around, hull);
  std::vector<Eigen::Vector2d> area;
  for (const cv::Point2f& corner : hull) area.emplace_back(corner.x, corner.y);
  return area;
}

void check_count(std::size_t count, int degree) {
  const std::size_t least = kPointsPerTerm * terms_of(degree);
  if (count < least)
    throw Error(
        formatted("{} points are known, but a polynomial of degree {} needs at least {}; show more of the plate", count,
                  degree, least));
}

/// The lowest degree that is nearly as good as the best one, as far as this number of points tells.
int chosen_degree(const std::vector<std::pair<int, double>>& validated_by_degree, std::size_t count) {
  const double tolerance = std::max(0.01, 1 / std::sqrt(double(count)));
  double least = std::numeric_limits<double>::infinity();
  for (const auto& [degree, residual] : validated_by_degree) least = std::min(least, residual);
  for (const auto& [degree, residual] : validated_by_degree)
    if (residual <= (1 + tolerance) * least) return degree;
  return validated_by_degree.back().first;
}

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

Fit fit_distortion(const PlatePoints& points, const FitOptions& options) {
  Fit fit;
  fit.points = points;
  std::vector<Eigen::Vector2d> displacement;
  std::vector<bool> is_used;
  for (std::size_t i = 0; i < points.used.size(); ++i) {
    displacement.push_back(points.seen_px[i] - points.ideal_px[i]);
    is_used.push_back(points.used[i] != 0);
  }
  const auto known = std::size_t(std::count(is_used.begin(), is_used.end(), true));
  check_count(known, options.lowest_degree);
  int highest = options.lowest_degree;
  while (highest < options.highest_degree && known >= kPointsPerTerm * terms_of(highest + 1)) ++highest;
  const Samples before = samples_of(points);
  std::vector<bool> is_near = is_used;
  fit_robustly(highest, before.middle(), before.half(), points.ideal_px, displacement, options.outlier_deviations,
               is_near);
  for (std::size_t i = 0; i < is_used.size(); ++i) fit.points.used[i] = is_used[i] && is_near[i] ? 1 : 0;
  const Samples samples = samples_of(fit.points);
  check_count(samples.ideal.size(), options.lowest_degree);
  while (highest > options.lowest_degree && samples.ideal.size() < kPointsPerTerm * terms_of(highest)) --highest;
  for (int degree = options.lowest_degree; degree <= highest; ++degree)
    fit.validated_by_degree_px.emplace_back(degree, validated(samples, degree, false));
  Distortion& distortion = fit.distortion;
  distortion.width_px = points.width_px;
  distortion.height_px = points.height_px;
  distortion.degree = chosen_degree(fit.validated_by_degree_px, samples.ideal.size());
  const Polynomial polynomial = samples.fitted(distortion.degree);
  distortion.terms_px = polynomial.terms;
  distortion.validated_px = fit.validated_by_degree_px[std::size_t(distortion.degree - options.lowest_degree)].second;
  if (options.model != Model::polynomial) {
    const double local = validated(samples, distortion.degree, true);
    fit.is_local = options.model == Model::local || local < 0.95 * distortion.validated_px;
    if (fit.is_local) {
      distortion.validated_px = local;
      put_lattice(samples, residuals(samples, polynomial), distortion);
    }
  }
  double squares = 0;
  for (std::size_t i = 0; i < samples.ideal.size(); ++i)
    squares += (samples.ideal[i] + samples.displacement[i] - seen_pixel(distortion, samples.ideal[i])).squaredNorm();
  distortion.residual_px = std::sqrt(squares / double(samples.ideal.size()));
  distortion.area_px = area_of(samples.ideal, options.area_margin_px);
  check_distortion(distortion, "the fitted distortion");
  return fit;
}

Shape shape_of(const Distortion& distortion, const PlatePoints& points) {
  const Eigen::Vector2d middle = 0.5 * Eigen::Vector2d(points.width_px - 1, points.height_px - 1);
  Shape shape;
  for (std::size_t i = 0; i < points.used.size(); ++i)
    if (points.used[i]) shape.rim_px = std::max(shape.rim_px, (points.ideal_px[i] - middle).norm());
  // With s = r^2 / rim^2 the angle is turn s, and the growth of the radius pincushion s / rim. Weights are r^2.
  double turn = 0, growth = 0, weights = 0;
  for (std::size_t i = 0; i < points.used.size(); ++i) {
    const Eigen::Vector2d off = points.ideal_px[i] - middle;
    if (!points.used[i] || off.norm() < 0.05 * shape.rim_px) continue;
    const Eigen::Vector2d seen = seen_pixel(distortion, points.ideal_px[i]) - middle;
    const double s = off.squaredNorm() / (shape.rim_px * shape.rim_px), weight = s * off.squaredNorm();
    turn += weight * std::atan2(off.x() * seen.y() - off.y() * seen.x(), off.dot(seen));
    growth += weight * (seen.norm() / off.norm() - 1);
    weights += weight * s;
  }
  if (weights > 0) {
    shape.turn_deg = degrees(turn / weights);
    shape.pincushion_px = growth / weights * shape.rim_px;
  }
  return shape;
}

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
