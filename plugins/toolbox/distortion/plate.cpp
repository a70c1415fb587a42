// SPDX-License-Identifier: Apache-2.0
#include "marrow/toolbox/distortion/plate.hpp"

#include <Eigen/Cholesky>
#include <Eigen/LU>
#include <cmath>
#include <complex>
#include <opencv2/calib3d.hpp>
#include <opencv2/imgproc.hpp>

#include "marrow/base/number_text.hpp"
#include "marrow/domain/decompositions.hpp"
#include "marrow/domain/quantile.hpp"

namespace marrow::distortion {
namespace {

constexpr double kSizeStep = 1.3;        ///< ratio of the diameters that are tried
constexpr double kLeastRoundness = 0.5;  ///< of a dot that the border of the field does not cut
constexpr double kLeastStrength = 0.8;   ///< of the median of a dot and its neighbours
constexpr double kNearlyAsMany = 0.92;   ///< of the most dots
constexpr int kLeastForTilt = 60;        ///< dots
constexpr double kLeastAtBorder = 0.5;   ///< of a dot's brightness, around it

cv::Mat1f grey_of(const Image& image) {
  if (image.pixels.empty() || image.pixels.channels() != 1)
    throw Error("the image of the plate is empty or has colours; an X-ray has one channel");
  cv::Mat1f grey;
  image.pixels.convertTo(grey, CV_32F);
  if (!cv::checkRange(grey, true)) throw Error("the image of the plate has a pixel that is not a finite number");
  return grey;
}

std::vector<double> diameters_of(const PlateSearch& search, const cv::Size& size) {
  if (search.dot_px > 0) return {search.dot_px};
  std::vector<double> diameters;
  const double largest = std::max(2.0, std::min(size.width, size.height) / 24.0);
  for (double diameter = 2; diameter <= largest; diameter *= kSizeStep) diameters.push_back(diameter);
  return diameters;
}

std::vector<PlateImage> candidates(const cv::Mat1f& grey, const PlateSearch& search) {
  std::vector<PlateImage> all;
  for (const double diameter : diameters_of(search, grey.size()))
    for (const bool is_bright : {true, false}) {
      if (search.is_bright && *search.is_bright != is_bright) continue;
      const std::vector<Spot> spots = find_spots(grey, 0.5 * diameter, is_bright);
      for (const Pattern grid : {Pattern::square, Pattern::hexagonal}) {
        if (search.grid && *search.grid != grid) continue;
        all.push_back({grid, is_bright, diameter, spots, find_grid(spots, grid), {}});
      }
    }
  return all;
}

/// A homography from the plate to the image by least squares, as a map of the plate onto itself: its derivative at the
/// plate's middle is the identity.
std::vector<Eigen::Vector2d> with_perspective(const std::vector<Eigen::Vector2d>& plate,
                                              const std::vector<Eigen::Vector2d>& seen) {
  std::vector<cv::Point2d> from, to;
  for (std::size_t i = 0; i < plate.size(); ++i) {
    from.emplace_back(plate[i].x(), plate[i].y());
    to.emplace_back(seen[i].x(), seen[i].y());
  }
  const cv::Mat1d h = cv::findHomography(from, to, 0);
  if (h.empty()) throw Error("the dots of the plate do not determine its perspective; they may lie on one line");
  std::vector<Eigen::Vector2d> places;
  for (const Eigen::Vector2d& at : plate) {
    const Eigen::Vector3d ray(h(0, 0) * at.x() + h(0, 1) * at.y() + h(0, 2),
                              h(1, 0) * at.x() + h(1, 1) * at.y() + h(1, 2),
                              h(2, 0) * at.x() + h(2, 1) * at.y() + h(2, 2));
    places.push_back(ray.head<2>() / ray.z());
  }
  return places;
}

/// The similarity nearest to a map's derivative that keeps its handedness.
Eigen::Matrix2d nearest_similarity(const Eigen::Matrix2d& map) {
  const double sign = map.determinant() < 0 ? -1 : 1;
  const double a = 0.5 * (map(0, 0) + sign * map(1, 1)), b = 0.5 * (map(1, 0) - sign * map(0, 1));
  Eigen::Matrix2d result;
  result << a, -sign * b, b, sign * a;
  return result;
}

double stretch_of(const Eigen::Matrix2d& map) {
  const Eigen::Vector2d squares = eigen_of_symmetric<2>(map.transpose() * map).values;
  return std::sqrt(squares[1] / squares[0]);
}

/// The image with everything closed that is narrower than `width_px`.
cv::Mat1f closed_of(const cv::Mat1f& grey, double width_px) {
  const int width = 2 * int(std::ceil(0.5 * width_px)) + 1;
  cv::Mat1f closed;
  cv::morphologyEx(grey, closed, cv::MORPH_CLOSE, cv::getStructuringElement(cv::MORPH_RECT, {width, width}));
  return closed;
}

/// The least brightness within three quarters of a dot's diameter of each pixel, as a share of that of the pixel. Both
/// are above the darkest, and the plate itself is closed. At the border of the field it is small.
cv::Mat1f share_around(const cv::Mat1f& grey, double spacing, double dot_px) {
  const cv::Mat1f closed = closed_of(grey, 2 * spacing);
  double darkest = 0;
  cv::minMaxLoc(closed, &darkest, nullptr);
  const int reach = 2 * int(std::ceil(0.75 * dot_px)) + 1;
  cv::Mat1f least, share;
  cv::erode(closed, least, cv::getStructuringElement(cv::MORPH_ELLIPSE, {reach, reach}));
  cv::divide(least - darkest, closed - darkest + 1e-9, share);
  return share;
}

/// Which dots are round, stand out nearly as much as their neighbours in the grid do, and lie inside the field.
std::vector<bool> which_are_whole(const PlateImage& plate, const cv::Mat1f& grey) {
  const cv::Mat1f around = share_around(grey, spacing_px(plate.spots, plate.dots, plate.grid), plate.dot_px);
  std::map<std::pair<int, int>, double> strengths;
  for (const GridDot& dot : plate.dots) strengths[{dot.column, dot.row}] = plate.spots[std::size_t(dot.spot)].strength;
  std::vector<bool> whole;
  for (const GridDot& dot : plate.dots) {
    std::vector<double> near;
    for (int row = -1; row <= 1; ++row)
      for (int column = -1; column <= 1; ++column)
        if (const auto one = strengths.find({dot.column + column, dot.row + row}); one != strengths.end())
          near.push_back(one->second);
    const Spot& spot = plate.spots[std::size_t(dot.spot)];
    const int u = std::clamp(int(std::lround(spot.at_px.x())), 0, grey.cols - 1),
              v = std::clamp(int(std::lround(spot.at_px.y())), 0, grey.rows - 1);
    whole.push_back(spot.roundness > kLeastRoundness && around(v, u) > kLeastAtBorder &&
                    spot.strength > kLeastStrength * quantile_in_place(near, 0.5));
  }
  return whole;
}

/// The point of the plate that is seen at a pixel, by Newton's method from `plate_place`.
Eigen::Vector2d place_seen_at(const Polynomial& seen_from_plate, Eigen::Vector2d plate_place,
                              const Eigen::Vector2d& pixel) {
  for (int round = 0; round < 20; ++round)
    plate_place += seen_from_plate.derivative_at(plate_place).inverse() * (pixel - seen_from_plate.at(plate_place));
  return plate_place;
}

constexpr int kSectors = 8;
constexpr double kMiddle = 0.1;          ///< deviation of the distortion's middle from the image's
constexpr double kLeastNoise_px = 0.05;  ///< of a dot

/// The linear part (4), the shift (2), the perspective (2), the distortion's middle (2), k_1 to k_3 (6).
constexpr int kUnknowns = 16, kPerspective = 6, kCentre = 8, kRound = 10;
using Unknowns = Eigen::Matrix<double, kUnknowns, 1>;
using Normal = Eigen::Matrix<double, kUnknowns, kUnknowns>;

/// A dot: where the plate would be seen without perspective and distortion, nearly, and where it is seen. The unit is
/// half the image's longer side.
struct Sample {
  Eigen::Vector2d plate, seen;
  int sector = 0;
};

Unknowns nothing() {
  Unknowns x = Unknowns::Zero();
  x[0] = x[3] = 1;
  return x;
}

/// Where a tilted plate is seen without distortion.
Eigen::Vector2d ideal_of(const Unknowns& x, const Eigen::Vector2d& plate) {
  const Eigen::Vector2d moved(x[0] * plate.x() + x[1] * plate.y() + x[4], x[2] * plate.x() + x[3] * plate.y() + x[5]);
  return moved / (1 + x[kPerspective] * plate.x() + x[kPerspective + 1] * plate.y());
}

Eigen::Vector2d seen_at(const Unknowns& x, const Eigen::Vector2d& plate) {
  const Eigen::Vector2d ideal = ideal_of(x, plate), off = ideal - x.segment<2>(kCentre);
  const double squared = off.squaredNorm();
  std::complex<double> sum = 0;
  for (int i = 2; i >= 0; --i) sum = squared * (sum + std::complex<double>(x[kRound + 2 * i], x[kRound + 2 * i + 1]));
  const std::complex<double> moved = sum * std::complex<double>(off.x(), off.y());
  return ideal + Eigen::Vector2d(moved.real(), moved.imag());
}

/// Weighted least squares with the prior of the middle.
struct Problem {
  const std::vector<Sample>& samples;
  double noise = 1;
  int left_out = -1;  ///< this sector

  double cost(const Unknowns& x) const {
    double sum = x.segment<2>(kCentre).squaredNorm() / (kMiddle * kMiddle);
    for (const Sample& one : samples)
      if (one.sector != left_out) sum += (seen_at(x, one.plate) - one.seen).squaredNorm() / (noise * noise);
    return sum;
  }
  void linearise(const Unknowns& x, Normal& normal, Unknowns& right) const {
    constexpr double kStep = 1e-6;
    normal.setZero();
    right.setZero();
    for (int k = kCentre; k < kCentre + 2; ++k) {
      normal(k, k) = 1 / (kMiddle * kMiddle);
      right[k] = -x[k] / (kMiddle * kMiddle);
    }
    for (const Sample& one : samples) {
      if (one.sector == left_out) continue;
      Eigen::Matrix<double, 2, kUnknowns> slope;
      for (int k = 0; k < kUnknowns; ++k) {
        Unknowns up = x, down = x;
        up[k] += kStep;
        down[k] -= kStep;
        slope.col(k) = (seen_at(up, one.plate) - seen_at(down, one.plate)) / (2 * kStep * noise);
      }
      normal += slope.transpose() * slope;
      right += slope.transpose() * (one.seen - seen_at(x, one.plate)) / noise;
    }
  }
};

/// Levenberg's and Marquardt's method.
Unknowns solved(const Problem& problem, Unknowns x) {
  double damping = 1e-3, cost = problem.cost(x);
  for (int round = 0; round < 60; ++round) {
    Normal normal;
    Unknowns right;
    problem.linearise(x, normal, right);
    normal.diagonal() += damping * normal.diagonal() + Unknowns::Constant(1e-9);
    const Unknowns step = normal.ldlt().solve(right), next = x + step;
    const double other = problem.cost(next);
    if (!(other < cost)) {
      if ((damping *= 10) > 1e8) break;
      continue;
    }
    const bool is_done = cost - other < 1e-8 * cost;
    x = next;
    cost = other;
    damping = std::max(1e-12, 0.1 * damping);
    if (is_done) break;
  }
  return x;
}

/// The variance of the perspective: of the normal equations and of the jackknife, whichever is larger.
double variance_of(Problem problem, const Unknowns& x) {
  Normal normal;
  Unknowns right;
  problem.linearise(x, normal, right);
  normal.diagonal().array() += 1e-9;
  const Normal covariance = normal.ldlt().solve(Normal::Identity());
  const double of_fit = covariance.diagonal().segment<2>(kPerspective).sum();
  std::vector<Eigen::Vector2d> without;
  Eigen::Vector2d mean = Eigen::Vector2d::Zero();
  for (problem.left_out = 0; problem.left_out < kSectors; ++problem.left_out) {
    without.emplace_back(solved(problem, x).segment<2>(kPerspective));
    mean += without.back() / kSectors;
  }
  double squares = 0;
  for (const Eigen::Vector2d& one : without) squares += (one - mean).squaredNorm();
  return 0.5 * std::max(of_fit, squares * (kSectors - 1) / kSectors);  // of one component
}

/// A perspective moves points by a quadratic function of their places, and so does a distortion whose middle is not
/// that of the image. They are told apart by one assumption: the distortion is round. About one middle c it moves a
/// point at z, outwards and around, by a function of its distance: (z - c) (k_1 r^2 + k_2 r^4 + k_3 r^6), where complex
/// numbers are places, r = |z - c|, and the real and imaginary part of k_i are pincushion and S-shape. The middle's
/// prior is that of the image, with a deviation of a tenth of half its side. All is fitted to the dots in use by least
/// squares. The deviation is the larger one of two: that of the fit's normal equations, and the jackknife's over eight
/// sectors of the image, which also sees what is not round.
///
/// `plate`: the dots on the plate, in any unit; `seen_px`: where the image of this size shows them.
PlateTilt tilt_of(const std::vector<Eigen::Vector2d>& plate, const std::vector<Eigen::Vector2d>& seen_px,
                  const std::vector<bool>& is_used, int width_px, int height_px) {
  const Eigen::Vector2d middle(0.5 * (width_px - 1), 0.5 * (height_px - 1));
  const double half = 0.5 * std::max(width_px, height_px);
  std::vector<Eigen::Vector2d> used, used_seen;
  for (std::size_t i = 0; i < plate.size(); ++i)
    if (is_used[i]) {
      used.push_back(plate[i]);
      used_seen.emplace_back((seen_px[i] - middle) / half);
    }
  const auto [centre, size] = square_around(used);
  const Polynomial flat = fit_polynomial(1, centre, size, used, used_seen);
  std::vector<Sample> samples;
  for (std::size_t i = 0; i < used.size(); ++i) {
    const double angle = std::atan2(used_seen[i].y(), used_seen[i].x()) + kPi;
    samples.push_back({flat.at(used[i]), used_seen[i], std::min(int(angle / (2 * kPi) * kSectors), kSectors - 1)});
  }
  Problem problem{samples, kLeastNoise_px / half};
  const Unknowns first = solved(problem, nothing());
  double squares = 0;
  for (const Sample& one : samples) squares += (seen_at(first, one.plate) - one.seen).squaredNorm();
  problem.noise = std::max(problem.noise, std::sqrt(squares / (2 * double(samples.size()))));
  const Unknowns x = solved(problem, first);
  PlateTilt tilt;
  tilt.perspective_px = half * x.segment<2>(kPerspective).norm();
  tilt.deviation_px = half * std::sqrt(variance_of(problem, x));
  for (const Eigen::Vector2d& one : plate) tilt.places.emplace_back(middle + half * ideal_of(x, flat.at(one)));
  return tilt;
}

}  // namespace

PlateImage find_plate(const Image& image, const PlateSearch& search, std::size_t least_dots) {
  const cv::Mat1f grey = grey_of(image);
  const std::vector<PlateImage> all = candidates(grey, search);
  std::size_t most = 0;
  for (const PlateImage& one : all) most = std::max(most, one.dots.size());
  const PlateImage* best = nullptr;
  double least_unevenness = 0;
  for (const PlateImage& one : all) {
    if (most == 0 || double(one.dots.size()) < kNearlyAsMany * double(most)) continue;
    const double unevenness = unevenness_px(one.spots, one.dots, one.grid);
    if (best && unevenness >= least_unevenness) continue;
    best = &one;
    least_unevenness = unevenness;
  }
  if (!best || most < least_dots)
    throw Error(
        formatted("{} dots or holes of a regular grid were found; at least {} are needed. Check that the image shows "
                  "the plate alone, and give grid, dots and dot_px if they are known",
                  most, least_dots));
  PlateImage found = *best;
  found.is_whole = which_are_whole(found, grey);
  return found;
}

StraightPlate straight_plate(const PlateImage& plate, Straight straight, int width_px, int height_px) {
  std::vector<Eigen::Vector2d> places, seen;
  for (const GridDot& dot : plate.dots) {
    places.push_back(place_on_plate(plate.grid, dot.column, dot.row));
    seen.push_back(plate.spots[std::size_t(dot.spot)].at_px);
  }
  StraightPlate result;
  if (straight == Straight::homography) {
    places = with_perspective(places, seen);
  } else if (std::count(plate.is_whole.begin(), plate.is_whole.end(), true) >= kLeastForTilt) {
    result.tilt = tilt_of(places, seen, plate.is_whole, width_px, height_px);
    result.is_tilted = straight == Straight::automatic && result.tilt.is_certain();
  }
  if (result.is_tilted) places = result.tilt.places;
  const Eigen::Vector2d middle(0.5 * (width_px - 1), 0.5 * (height_px - 1));
  std::size_t central = 0;
  for (std::size_t i = 0; i < seen.size(); ++i)
    if ((seen[i] - middle).squaredNorm() < (seen[central] - middle).squaredNorm()) central = i;
  const double spacing = spacing_px(plate.spots, plate.dots, plate.grid);
  const Eigen::Vector2d anchor = (seen[central] - middle).norm() < spacing ? middle : seen[central];
  std::vector<bool> is_used(places.size(), true);
  const auto [centre, half] = square_around(places);
  const int degree = places.size() >= 120 ? 5 : 3;
  const Polynomial seen_from_plate = fit_robustly(degree, centre, half, places, seen, 5, is_used);
  const Eigen::Vector2d origin = place_seen_at(seen_from_plate, places[central], anchor);
  const Eigen::Matrix2d derivative = seen_from_plate.derivative_at(origin);
  if (!derivative.allFinite() || !(std::abs(derivative.determinant()) > 0) || !origin.allFinite())
    throw Error("the dots of the plate do not determine where its middle is; they may lie on one line");
  const Eigen::Matrix2d image_from_plate =
      straight == Straight::similarity || straight == Straight::automatic ? nearest_similarity(derivative) : derivative;
  result.stretch = stretch_of(derivative);
  result.points.width_px = width_px;
  result.points.height_px = height_px;
  for (std::size_t i = 0; i < places.size(); ++i)
    result.points.add(anchor + image_from_plate * (places[i] - origin), seen[i], plate.is_whole[i]);
  result.pixels_per_spacing = straight == Straight::homography || result.is_tilted
                                  ? spacing
                                  : std::sqrt(std::abs(image_from_plate.determinant()));
  return result;
}

double covered_share(const std::vector<Eigen::Vector2d>& points, double reach_px, const cv::Mat1b& area) {
  cv::Mat1b near(area.size(), std::uint8_t(0));
  for (const Eigen::Vector2d& at : points)
    cv::circle(near, {int(std::lround(at.x())), int(std::lround(at.y()))}, int(std::ceil(reach_px)), cv::Scalar(255),
               cv::FILLED);
  const int total = cv::countNonZero(area);
  return total == 0 ? 0 : double(cv::countNonZero(near & area)) / total;
}

cv::Mat1b field_of(const Image& image, double width_px) {
  const cv::Mat1f grey = grey_of(image);
  const cv::Mat1f closed = closed_of(grey, width_px);
  std::vector<float> sorted(closed.begin(), closed.end());
  const double bright = quantile_in_place(sorted, 0.95), dark = sorted.empty() ? 0 : quantile_in_place(sorted, 0.0);
  return closed > dark + 0.25 * (bright - dark);
}

}  // namespace marrow::distortion
