// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <Eigen/Core>
#include <cmath>
#include <marrow/domain/decompositions.hpp>
#include <vector>

#include "sight.hpp"

namespace marrow::refine {

/// What is expected of the cameras' motions: a Gaussian density. A motion that all cameras share changes no image,
/// because the bones can follow it. So the images cannot tell how large it is, and it always counts as expected. The
/// images only tell the scale of the rest: how far the cameras are off relative to each other.
class CameraPrior {
 public:
  explicit CameraPrior(const std::vector<Sight>& sights) {
    const Eigen::Index n = 6 * Eigen::Index(sights.size());
    Eigen::MatrixXd weight = Eigen::MatrixXd::Zero(n, n);
    Eigen::MatrixXd of_shared = Eigen::MatrixXd::Zero(n, 6);  // each camera's motion, for one of the whole world
    for (std::size_t v = 0; v < sights.size(); ++v) {
      const Eigen::Index m = 6 * Eigen::Index(v);
      weight.block<6, 6>(m, m) = inverse_of_symmetric(sights[v].covariance);
      of_shared.block<3, 3>(m, 0) = of_shared.block<3, 3>(m + 3, 3) = sights[v].axes.transpose();
    }
    // The shared motion is the mean of all motions, weighed by their inverse covariances. What is left of each motion
    // does not correlate with it.
    const Eigen::MatrixXd weighted = weight * of_shared;
    const Matrix6d normal = of_shared.transpose() * weighted;
    mean_ = inverse_of_symmetric(normal) * weighted.transpose();
    const Eigen::MatrixXd shared_part = of_shared * mean_, rest = Eigen::MatrixXd::Identity(n, n) - shared_part;
    shared_ = shared_part.transpose() * weight * shared_part;
    rest_ = rest.transpose() * weight * rest;
  }

  /// The inverse covariance of all motions, if the cameras are off relative to each other by `scale` times what is
  /// expected.
  Eigen::MatrixXd inverse_covariance(double scale) const { return shared_ + rest_ / (scale * scale); }
  /// The motion of the whole world that is most probable with these motions, about and along its axes.
  Vector6d shared_motion(const Eigen::VectorXd& all_motions) const { return mean_ * all_motions; }
  /// The logarithm of the density's factor that depends on the scale.
  double log_factor(double scale) const { return -double(shared_.rows() - 6) * std::log(scale); }

 private:
  Eigen::MatrixXd mean_, shared_, rest_;
};

/// A matrix F with F F^T = a^-1, for a symmetric and positive definite matrix. J F F^T J^T is then the covariance of J
/// x for any J, and never indefinite, however much cancels. The numbers may differ much in size, so they are scaled
/// first.
inline Eigen::MatrixXd root_of_inverse(Eigen::MatrixXd a) {
  a.diagonal().array() += 1e-9;  // for a direction that nothing determines
  const Eigen::VectorXd scale = a.diagonal().cwiseSqrt().cwiseInverse();
  const auto eigen = eigen_of_symmetric<Eigen::Dynamic>(scale.asDiagonal() * a * scale.asDiagonal());
  return scale.asDiagonal() * eigen.vectors * eigen.values.cwiseSqrt().cwiseInverse().asDiagonal();
}

}  // namespace marrow::refine
