// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <algorithm>
#include <array>
#include <cmath>
#include <marrow/domain/functions.hpp>
#include <string>
#include <vector>
#include "marrow/domain/decompositions.hpp"

namespace marrow::search {

/// Moves a pose in the units of the search: degrees about and millimetres along the fragment's axes.
inline marrow::RigidTransform moved_by_units(const marrow::RigidTransform& pose, const marrow::FragmentFrame& frame,
                                             const marrow::Vector6d& deg_and_mm) {
  marrow::Vector6d motion = deg_and_mm;
  motion.head<3>() *= marrow::radians(1);
  return marrow::moved(pose, frame, motion);
}

/// The covariance of a minimum, predicted from the curvature of the cost there: the inverse of likelihood_factor *
/// Hessian. The Hessian is made of central differences. Each axis has its own step, which raises the cost by about 0.1
/// to 0.3 px: large enough that the roughness of the cost does not matter, and still near the minimum.
class PredictedCovariance {
 public:
  PredictedCovariance(const marrow::Cost& cost, const marrow::RigidTransform& pose, const marrow::FragmentFrame& frame,
                      double likelihood_factor)
      : cost_(cost), pose_(pose), frame_(frame), value_(cost.value(pose)) {
    for (int axis = 0; axis < 6; ++axis) choose_step(axis);
    invert(hessian(), likelihood_factor);
  }

  /// Covariance of (r, t) in rad and mm, as in Pose.
  const marrow::Matrix6d& covariance() const { return covariance_; }
  int evaluations() const { return evaluations_; }

  /// A sentence for each axis that the images hardly determine.
  std::vector<std::string> warnings(double most_deg, double most_mm) const {
    static const std::array<const char*, 6> kAxes = {
        "rotation about the frontal axis",    "rotation about the lateral axis",    "axial rotation",
        "translation along the frontal axis", "translation along the lateral axis", "axial translation"};
    std::vector<std::string> warnings;
    for (int axis = 0; axis < 6; ++axis) {
      const bool turn = axis < 3;
      const double sd = std::sqrt(covariance_(axis, axis)), shown = turn ? marrow::degrees(sd) : sd;
      if (shown <= (turn ? most_deg : most_mm)) continue;
      if (undetermined_[std::size_t(axis)])
        warnings.push_back(std::string(kAxes[std::size_t(axis)]) +
                           " is not determined by these images: the cost hardly changes within " + number(kMostStep) +
                           (turn ? " degrees" : " mm"));
      else
        warnings.push_back(std::string(kAxes[std::size_t(axis)]) +
                           " is poorly determined by these images: its predicted standard deviation is " +
                           number(shown) + (turn ? " degrees" : " mm"));
    }
    return warnings;
  }

 private:
  static constexpr double kMostStep = 16, kLeastStep = 1.0 / 64;  // degrees or mm
  static constexpr double kLeastRise_px = 0.05, kGoodRise_px = 0.1, kMostRise_px = 0.3;

  static std::string number(double value) {
    char text[32];
    std::snprintf(text, sizeof text, "%.3g", value);
    return text;
  }

  double rise(int axis, double step) {
    const marrow::Vector6d motion = step * marrow::Vector6d::Unit(axis);
    evaluations_ += 2;
    return 0.5 * (cost_.value(moved_by_units(pose_, frame_, motion)) +
                  cost_.value(moved_by_units(pose_, frame_, -motion))) -
           value_;
  }

  void choose_step(int axis) {
    double step = 0.5, height = rise(axis, step);
    while (height > kMostRise_px && step > kLeastStep) height = rise(axis, step /= 2);
    while (height < kGoodRise_px && step < kMostStep) height = rise(axis, step *= 2);
    steps_[axis] = step;
    rises_[axis] = height;
    undetermined_[std::size_t(axis)] = height < kLeastRise_px;
  }

  /// The Hessian in units of the steps. A mixed second derivative is the mean rise along the diagonal of two axes, in
  /// both senses, minus the rises along the two axes.
  marrow::Matrix6d hessian() {
    std::vector<marrow::RigidTransform> poses;
    for (int i = 0; i < 6; ++i)
      for (int j = 0; j < i; ++j)
        for (const double sense : {1.0, -1.0}) {
          marrow::Vector6d motion = marrow::Vector6d::Zero();
          motion[i] = sense * steps_[i];
          motion[j] = sense * steps_[j];
          poses.push_back(moved_by_units(pose_, frame_, motion));
        }
    const std::vector<double> values = cost_.values(poses);
    evaluations_ += int(values.size());
    marrow::Matrix6d h;
    auto value = values.begin();
    for (int i = 0; i < 6; ++i) {
      h(i, i) = 2 * rises_[i];
      for (int j = 0; j < i; ++j, value += 2)
        h(i, j) = h(j, i) = 0.5 * (value[0] + value[1]) - value_ - rises_[i] - rises_[j];
    }
    return h;
  }

  void invert(marrow::Matrix6d h, double factor) {
    constexpr double kMostVariance = 100 * 100;  // in squared steps; used for directions that nothing determines
    for (int i = 0; i < 6; ++i)
      if (undetermined_[std::size_t(i)]) {
        h.row(i).setZero();
        h.col(i).setZero();
      }
    const marrow::SymmetricEigen<6> eigen = marrow::eigen_of_symmetric(h);
    marrow::Vector6d variances;
    for (int i = 0; i < 6; ++i) {
      const double information = factor * eigen.values[i];
      variances[i] = information > 1 / kMostVariance ? 1 / information : kMostVariance;
    }
    marrow::Vector6d scale = steps_;
    scale.head<3>() *= marrow::radians(1);
    const marrow::Matrix6d vectors = scale.asDiagonal() * eigen.vectors;
    covariance_ = vectors * variances.asDiagonal() * vectors.transpose();
  }

  const marrow::Cost& cost_;
  const marrow::RigidTransform& pose_;
  const marrow::FragmentFrame& frame_;
  const double value_;
  int evaluations_ = 1;
  marrow::Vector6d steps_, rises_;
  std::array<bool, 6> undetermined_{};
  marrow::Matrix6d covariance_;
};

}  // namespace marrow::search
