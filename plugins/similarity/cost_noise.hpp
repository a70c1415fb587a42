// SPDX-License-Identifier: Apache-2.0
#pragma once
// How much a cost of images counts beside what is known from elsewhere.
#include <algorithm>
#include <array>
#include <cmath>
#include <marrow/domain/decompositions.hpp>
#include <string>

#include "marrow/base/error.hpp"
#include "marrow/domain/functions.hpp"
#include "marrow/domain/quantile.hpp"

namespace marrow::similarity {

/// The value in a cost of one unit of the negative log-likelihood: twice the rise of the cost if the pose moves by one
/// standard deviation. The median over six directions. `found`: the cost's minimum, which check_found() accepts.
inline double noise_of(const Cost& cost, const Pose& found) {
  constexpr double kDeviations = 2, kMostStep = 4;  // a step in degrees or mm
  Vector6d unit = Vector6d::Ones();
  unit.head<3>() *= degrees(1);
  const auto eigen = eigen_of_symmetric<6>(unit.asDiagonal() * *found.covariance * unit.asDiagonal());
  std::vector<RigidTransform> poses{found.world_from_model};
  std::array<double, 6> steps{};
  for (int i = 0; i < 6; ++i) {
    const double deviation = std::sqrt(std::max(eigen.values[i], 1e-12)),
                 step = std::min(kDeviations * deviation, kMostStep);
    steps[std::size_t(i)] = step / deviation;
    for (const double sense : {1.0, -1.0}) {
      const Vector6d motion = sense * step * eigen.vectors.col(i);
      poses.push_back(moved(found.world_from_model, found.frame, motion.cwiseQuotient(unit)));
    }
  }
  const std::vector<double> values = cost.values(poses);
  std::vector<double> noise(6);
  for (std::size_t i = 0; i < 6; ++i) {
    const double rise = 0.5 * (values[2 * i + 1] + values[2 * i + 2]) - values[0];
    noise[i] = 2 * rise / (steps[i] * steps[i]);
  }
  return std::max(1e-12, quantile_in_place(noise, 0.5));
}

/// Throws Error if check_pose() refuses the pose, or if its covariance is absent or not positive definite. The message
/// begins with `name` and ends with `remedy`.
inline void check_known(const Pose& pose, const std::string& name, const std::string& remedy) {
  check_pose(pose, name);
  if (!pose.covariance) throw Error(name + " has no covariance; " + remedy);
  if (!pose.covariance->allFinite() || !(eigen_of_symmetric<6>(*pose.covariance).values[0] > 0))
    throw Error(name + " has a covariance that is not positive definite; " + remedy);
}
/// Throws Error unless a pose that a registration has found by a cost has a finite covariance.
inline void check_found(const Pose& found) {
  const std::string what = "the pose found by the images",
                    remedy = "; take it from a registration by a cost of the kind similarity, which predicts one";
  check_pose(found, what);
  if (!found.covariance) throw Error(what + " has no covariance" + remedy);
  if (!found.covariance->allFinite()) throw Error(what + " has a covariance that is not finite" + remedy);
}

}  // namespace marrow::similarity
