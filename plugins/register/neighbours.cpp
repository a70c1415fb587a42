// SPDX-License-Identifier: Apache-2.0
#include "neighbours.hpp"

#include <algorithm>
#include <cmath>
#include <marrow/domain/decompositions.hpp>

namespace marrow::together {
namespace {

/// Steps of a bone along the principal axes of its covariance, a column each, and how long they are in deviations.
struct Steps {
  std::size_t bone = 0;
  Matrix6d root;  ///< the covariance is root * root^T
  Vector6d in_deviations = Vector6d::Zero();

  Vector6d step(int axis) const { return in_deviations[axis] * root.col(axis); }
};

Steps steps_of(std::size_t bone, const Matrix6d& covariance) {
  constexpr double kDeviations = 4, kMost = 4;  // the longest step in degrees and mm
  Vector6d unit = Vector6d::Ones();
  unit.head<3>() *= degrees(1);
  const auto eigen = eigen_of_symmetric<6>(unit.asDiagonal() * covariance * unit.asDiagonal());
  Steps steps{bone, Matrix6d::Zero(), Vector6d::Zero()};
  for (int i = 0; i < 6; ++i) {
    const double deviation = std::sqrt(std::max(eigen.values[i], 1e-12));
    steps.root.col(i) = deviation * eigen.vectors.col(i).cwiseQuotient(unit);
    steps.in_deviations[i] = std::min(kDeviations, kMost / deviation);
  }
  return steps;
}

class Curvature {
 public:
  Curvature(const std::vector<Pose>& poses, const JointCost& cost) : poses_(poses), cost_(cost) {
    for (const Pose& pose : poses) at_.push_back(pose.world_from_model);
    here_ = cost(at_);
  }

  /// The second derivatives along the steps of one bone, in units of their lengths.
  Vector6d of(const Steps& a) const {
    Vector6d curvature;
    for (int i = 0; i < 6; ++i) curvature[i] = at({{a.bone, a.step(i)}}) + at({{a.bone, -a.step(i)}}) - 2 * here_;
    return curvature;
  }
  /// The mixed ones of two bones.
  Matrix6d of(const Steps& a, const Steps& b) const {
    Matrix6d mixed;
    for (int i = 0; i < 6; ++i)
      for (int j = 0; j < 6; ++j) {
        const auto both = [&](double p, double q) { return at({{a.bone, p * a.step(i)}, {b.bone, q * b.step(j)}}); };
        mixed(i, j) = 0.25 * (both(1, 1) - both(1, -1) - both(-1, 1) + both(-1, -1));
      }
    return mixed;
  }

 private:
  double at(const std::vector<std::pair<std::size_t, Vector6d>>& motions) const {
    std::vector<RigidTransform> poses = at_;
    for (const auto& [bone, motion] : motions) poses[bone] = marrow::moved(poses[bone], poses_[bone].frame, motion);
    return cost_(poses);
  }

  const std::vector<Pose>& poses_;
  const JointCost& cost_;
  std::vector<RigidTransform> at_;
  double here_ = 0;
};

/// A root of the inverse of a symmetric matrix with ones on its diagonal. Rough costs may give correlations that no
/// information has, so its eigenvalues count as this at least.
Eigen::MatrixXd root_of_inverse(const Eigen::MatrixXd& matrix) {
  constexpr double kLeast = 0.04;  // so no deviation grows more than five times
  const auto eigen = eigen_of_symmetric<Eigen::Dynamic>(matrix);
  return eigen.vectors * eigen.values.cwiseMax(kLeast).cwiseSqrt().cwiseInverse().asDiagonal();
}

/// The correlations of the curvatures of two bones along their steps.
Matrix6d correlations(const Matrix6d& mixed, const Vector6d& first, const Vector6d& second) {
  Matrix6d correlations = Matrix6d::Zero();
  for (int i = 0; i < 6; ++i)
    for (int j = 0; j < 6; ++j)
      if (first[i] > 0 && second[j] > 0)
        correlations(i, j) = std::clamp(mixed(i, j) / std::sqrt(first[i] * second[j]), -1.0, 1.0);
  return correlations;
}

}  // namespace

std::vector<RigidTransform> moved(const std::vector<Pose>& poses, const Eigen::VectorXd& motions) {
  std::vector<RigidTransform> result;
  for (std::size_t b = 0; b < poses.size(); ++b)
    result.push_back(marrow::moved(poses[b].world_from_model, poses[b].frame, motions.segment<6>(6 * Eigen::Index(b))));
  return result;
}

Eigen::MatrixXd root_of_covariance(const std::vector<Pose>& poses, const JointCost& cost) {
  std::vector<Steps> steps;
  for (std::size_t b = 0; b < poses.size(); ++b) {
    if (!poses[b].covariance || !poses[b].covariance->allFinite()) return {};
    steps.push_back(steps_of(b, *poses[b].covariance));
  }
  const Curvature curvature(poses, cost);
  std::vector<Vector6d> own;
  for (const Steps& one : steps) own.push_back(curvature.of(one));
  const auto n = 6 * Eigen::Index(steps.size());
  Eigen::MatrixXd information = Eigen::MatrixXd::Identity(n, n), deviations = Eigen::MatrixXd::Zero(n, n);
  for (std::size_t a = 0; a < steps.size(); ++a) {
    const Eigen::Index row = 6 * Eigen::Index(a);
    deviations.block<6, 6>(row, row) = steps[a].root;
    for (std::size_t b = 0; b < a; ++b) {
      const Eigen::Index column = 6 * Eigen::Index(b);
      const Matrix6d between = correlations(curvature.of(steps[a], steps[b]), own[a], own[b]);
      information.block<6, 6>(row, column) = between;
      information.block<6, 6>(column, row) = between.transpose();
    }
  }
  return deviations * root_of_inverse(information);
}

}  // namespace marrow::together
