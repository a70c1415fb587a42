// SPDX-License-Identifier: Apache-2.0
#include "marrow/toolbox/distortion/plate_tilt.hpp"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <complex>

#include "marrow/domain/transform.hpp"
#include "marrow/toolbox/distortion/polynomial.hpp"

namespace marrow::distortion {
namespace {

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

}  // namespace

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

}  // namespace marrow::distortion
