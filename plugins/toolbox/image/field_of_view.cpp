// SPDX-License-Identifier: Apache-2.0
#include "marrow/toolbox/image/field_of_view.hpp"

#include <Eigen/LU>
#include <algorithm>
#include <array>
#include <cmath>
#include <marrow/base/error.hpp>
#include <opencv2/imgproc.hpp>
#include <random>
#include "marrow/domain/decompositions.hpp"

namespace marrow::image {
namespace {

constexpr int kRays = 720, kStepsPerRay = 6, kTrials = 400, kHarmonics = 9;
constexpr double kDarkCorner = 0.25;  // part of the brightest pixel; not 0, because scatter reaches behind a collimator
constexpr double kSupported =
    0.5;  // least part of the rays crossing the outline within the image that have a step there
constexpr double kMostLit = 0.25;  // largest part of the pixels beyond the outline that is not dark
// A rim inside the outline is left out, because it is blurred and because a collimator's iris may cut a crescent off
// the intensifier's field. Its width is the larger of kRim_px and kRim times the radius.
constexpr double kRim_px = 3, kRim = 0.02;
constexpr double kTolerance_px = 2.5;

/// A point on a ray from the image's middle where the brightness drops outwards.
struct Step {
  cv::Point2d at;
  double drop;  // between 0 and 1, relative to the brightness on both sides
};
using Steps = std::vector<std::vector<Step>>;  // for each ray, the steepest first

std::array<cv::Point, 4> corners_of(const cv::Mat& image) {
  return {cv::Point(0, 0), cv::Point(image.cols - 1, 0), cv::Point(0, image.rows - 1),
          cv::Point(image.cols - 1, image.rows - 1)};
}

std::vector<Step> steps_along(const cv::Mat& grey, const cv::Point2d& from, double angle, double largest) {
  const cv::Point2d way(std::cos(angle), std::sin(angle));
  const double reach_u = (way.x > 0 ? grey.cols - 1 - from.x : from.x) / std::max(1e-9, std::abs(way.x));
  const double reach_v = (way.y > 0 ? grey.rows - 1 - from.y : from.y) / std::max(1e-9, std::abs(way.y));
  const int length = int(std::min(reach_u, reach_v)), half = std::max(3, std::min(grey.cols, grey.rows) / 250);
  std::vector<double> sums{0};  // cumulative brightness
  for (int r = 0; r <= length; ++r)
    sums.push_back(sums.back() +
                   grey.at<float>(int(std::lround(from.y + r * way.y)), int(std::lround(from.x + r * way.x))));
  const auto inside = [&](int r) { return (sums[r] - sums[r - half]) / half; };
  const auto outside = [&](int r) { return (sums[r + 1 + half] - sums[r + 1]) / half; };
  const auto drop = [&](int r) { return (inside(r) - outside(r)) / (inside(r) + outside(r) + 0.1 * largest); };
  std::vector<Step> steps;
  const int first = std::max(half, length / 4) + 1, end = int(sums.size()) - half - 2;
  for (int r = first; r < end; ++r) {
    if (!(drop(r) > 0.05 && drop(r) >= drop(r - 1) && drop(r) > drop(r + 1))) continue;
    int steepest = r;  // the relative drop has its maximum farther outside than the absolute one
    for (int other = std::max(first, r - half); other < r; ++other)
      if (inside(other) - outside(other) > inside(steepest) - outside(steepest)) steepest = other;
    steps.push_back({from + steepest * way, drop(r)});
  }
  std::stable_sort(steps.begin(), steps.end(), [](const Step& a, const Step& b) { return a.drop > b.drop; });
  if (steps.size() > kStepsPerRay) steps.resize(kStepsPerRay);
  return steps;
}

struct Circle {
  cv::Point2d centre;
  double radius = 0;
};

Circle through(const cv::Point2d& a, const cv::Point2d& b, const cv::Point2d& c) {
  Eigen::Matrix2d rows;
  rows << b.x - a.x, b.y - a.y, c.x - a.x, c.y - a.y;
  if (std::abs(rows.determinant()) < 1) return {};
  const Eigen::Vector2d right(0.5 * (b.dot(b) - a.dot(a)), 0.5 * (c.dot(c) - a.dot(a)));
  const Eigen::Vector2d centre = rows.inverse() * right;
  return {{centre.x(), centre.y()}, std::hypot(a.x - centre.x(), a.y - centre.y())};
}

/// RANSAC: of circles through the steepest steps of three random rays, the one near which most rays have a step.
Circle best_circle(const Steps& steps, double tolerance_px, double largest_radius) {
  std::vector<std::size_t> rays;
  for (std::size_t i = 0; i < steps.size(); ++i)
    if (!steps[i].empty()) rays.push_back(i);
  Circle best;
  if (rays.size() < kRays / 10) return best;
  std::mt19937 random(1);
  int most = 0;
  for (int trial = 0; trial < kTrials; ++trial) {
    const auto any = [&] { return steps[rays[random() % rays.size()]][0].at; };
    const cv::Point2d a = any(), b = any(), c = any();
    const Circle circle = through(a, b, c);
    if (!(circle.radius > 0) || circle.radius > largest_radius) continue;
    const auto near = [&](const Step& step) {
      return std::abs(cv::norm(step.at - circle.centre) - circle.radius) < tolerance_px;
    };
    int count = 0;
    for (const std::size_t ray : rays) count += std::any_of(steps[ray].begin(), steps[ray].end(), near);
    if (count > most) most = count, best = circle;
  }
  return best;
}

Eigen::VectorXd waves(double angle, int count) {
  Eigen::VectorXd values(count);
  for (int i = 0; i < count; ++i) {
    const int harmonic = (i + 1) / 2;
    const double turn = harmonic * angle;
    values[i] = i == 0 ? 1 : i % 2 ? std::cos(turn) : std::sin(turn);
  }
  return values;
}

/// The steps within the tolerance of the field's outline, at most one per ray.
std::vector<Step> supporting(const Steps& steps, const Field& field, double tolerance_px) {
  std::vector<Step> found;
  for (const auto& ray : steps)
    for (const Step& step : ray) {
      const cv::Point2d from = step.at - field.centre;
      if (std::abs(cv::norm(from) - field.radius(std::atan2(from.y, from.x))) > tolerance_px) continue;
      found.push_back(step);
      break;
    }
  return found;
}

/// Fits outline and centre by least squares. Higher harmonics are damped, so that the outline stays a circle where
/// there are no steps.
void fit(const std::vector<Step>& steps, int harmonics, Field& field) {
  Eigen::MatrixXd normal = Eigen::MatrixXd::Zero(harmonics, harmonics);
  Eigen::VectorXd right = Eigen::VectorXd::Zero(harmonics);
  for (const Step& step : steps) {
    const cv::Point2d from = step.at - field.centre;
    const Eigen::VectorXd row = waves(std::atan2(from.y, from.x), harmonics);
    normal += row * row.transpose();
    right += row * cv::norm(from);
  }
  for (int i = 3; i < harmonics; ++i) normal(i, i) += 0.05 * double(steps.size());
  const Eigen::VectorXd solution = solve_symmetric(normal, right);
  field.harmonics.assign(solution.data(), solution.data() + harmonics);
  if (harmonics < 3) return;
  field.centre += cv::Point2d(solution[1], solution[2]);
  field.harmonics[1] = field.harmonics[2] = 0;
}

/// Number of directions in which the field's outline lies within the image.
int rays_within(const cv::Mat& grey, const Field& field) {
  int count = 0;
  for (int i = 0; i < kRays; ++i) {
    const double angle = 2 * kPi * i / kRays, radius = field.radius(angle);
    const cv::Point2d at = field.centre + radius * cv::Point2d(std::cos(angle), std::sin(angle));
    count += at.x > 8 && at.y > 8 && at.x < grey.cols - 9 && at.y < grey.rows - 9;
  }
  return count;
}

bool is_outside(const Field& field, const cv::Point& pixel) {
  const cv::Point2d from = cv::Point2d(pixel) - field.centre;
  return cv::norm(from) > field.radius(std::atan2(from.y, from.x));
}

/// The part of the pixels beyond the outline that is not dark. A plate across a rectangular collimator's field, or an
/// arc of cables, may look like an outline, but there the image goes on behind it.
double lit_outside(const cv::Mat& grey, const Field& field, double largest) {
  int outside = 0, lit = 0;
  for (int v = 0; v < grey.rows; v += 4)
    for (int u = 0; u < grey.cols; u += 4)
      if (is_outside(field, {u, v})) {
        ++outside;
        lit += grey.at<float>(v, u) >= kDarkCorner * largest;
      }
  return outside ? double(lit) / outside : 0;
}

/// Black areas that reach the corners, if at least three corners are black; else empty.
cv::Mat black_corners(const cv::Mat& grey, double smallest, double largest) {
  if (smallest > 0.1 * largest) return {};
  const double black = smallest + 0.02 * (largest - smallest);
  const auto corners = corners_of(grey);
  const auto is_black = [&](const cv::Point& corner) { return grey.at<float>(corner) <= black; };
  if (std::count_if(corners.begin(), corners.end(), is_black) < 3) return {};
  cv::Mat labels;
  cv::connectedComponents(grey <= black, labels, 4, CV_32S);
  cv::Mat dark(grey.size(), CV_8U, cv::Scalar(0));
  for (const cv::Point& corner : corners)
    if (is_black(corner)) dark |= labels == labels.at<int>(corner);
  return dark;
}

cv::Mat within(const Field& field, const cv::Size& size, double margin_px) {
  std::vector<cv::Point> outline;
  for (int i = 0; i < kRays; ++i) {
    const double angle = 2 * kPi * i / kRays, radius = std::max(0.0, field.radius(angle) - margin_px);
    outline.emplace_back(field.centre + radius * cv::Point2d(std::cos(angle), std::sin(angle)));
  }
  cv::Mat inside(size, CV_8U, cv::Scalar(0));
  cv::fillPoly(inside, std::vector{outline}, 255);
  return inside;
}

}  // namespace

double Field::radius(double angle) const {
  return waves(angle, int(harmonics.size()))
      .dot(Eigen::Map<const Eigen::VectorXd>(harmonics.data(), long(harmonics.size())));
}

std::optional<Field> collimator_field(const cv::Mat& grey, double largest) {
  const auto corners = corners_of(grey);
  const auto dark = [&](const cv::Point& corner) { return grey.at<float>(corner) < kDarkCorner * largest; };
  if (std::count_if(corners.begin(), corners.end(), dark) < 3) return std::nullopt;

  const cv::Point2d middle(0.5 * (grey.cols - 1), 0.5 * (grey.rows - 1));
  const double side = std::min(grey.rows, grey.cols), coarse_px = std::max(kTolerance_px, 0.01 * side);
  Steps steps;
  for (int i = 0; i < kRays; ++i) steps.push_back(steps_along(grey, middle, 2 * kPi * i / kRays, largest));
  const Circle circle = best_circle(steps, coarse_px, 2 * side);
  if (circle.radius < 0.25 * side) return std::nullopt;
  Field field{circle.centre, {circle.radius}};
  for (const auto& [tolerance_px, harmonics] : {std::pair(coarse_px, 3),
                                                {0.6 * coarse_px, 5},
                                                {std::max(kTolerance_px, 0.3 * coarse_px), kHarmonics},
                                                {kTolerance_px, kHarmonics}})
    fit(supporting(steps, field, tolerance_px), harmonics, field);

  const double found = double(supporting(steps, field, kTolerance_px).size());
  const auto outside = [&](const cv::Point& corner) { return is_outside(field, corner); };
  constexpr int kFewest = kRays / 10;
  if (found < kFewest || found < kSupported * rays_within(grey, field) ||
      std::count_if(corners.begin(), corners.end(), outside) < 3 || lit_outside(grey, field, largest) > kMostLit)
    return std::nullopt;
  return field;
}

cv::Mat usable_pixels(const View& view, const cv::Mat& grey, double smallest, double largest, int margin_px) {
  cv::Mat usable(grey.size(), CV_8U, cv::Scalar(255));
  if (2 * margin_px >= std::min(grey.rows, grey.cols)) return cv::Mat(grey.size(), CV_8U, cv::Scalar(0));
  const cv::Mat dark = black_corners(grey, smallest, largest);
  if (!dark.empty()) usable.setTo(0, dark);
  if (!view.mask.empty()) usable.setTo(0, view.mask == 0);
  if (!dark.empty() || !view.mask.empty()) {
    const cv::Size size(2 * margin_px + 1, 2 * margin_px + 1);
    cv::erode(usable, usable, cv::getStructuringElement(cv::MORPH_RECT, size));
  }
  if (const auto field = collimator_field(grey, largest))
    usable &= within(*field, grey.size(), margin_px + std::max(kRim_px, kRim * field->harmonics[0]));
  for (cv::Mat strip : {usable.rowRange(0, margin_px), usable.rowRange(grey.rows - margin_px, grey.rows),
                        usable.colRange(0, margin_px), usable.colRange(grey.cols - margin_px, grey.cols)})
    strip.setTo(0);  // filters there use pixels mirrored at the border
  return usable;
}

}  // namespace marrow::image
