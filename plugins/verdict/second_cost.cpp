// SPDX-License-Identifier: Apache-2.0
// Where a second cost leads from a pose. The way begins at the judged pose, not where its own search began. So the same
// pose always gets the same judgement.
#include <Eigen/QR>
#include <algorithm>

#include <marrow/domain/decompositions.hpp>
#include "judged.hpp"
#include "marrow/domain/random.hpp"

namespace marrow::verdict {
namespace {

constexpr int kPoses = 112, kTerms = 28;  ///< a quadratic function of six numbers has 1 + 6 + 21 terms

/// A round of the way: how far poses around are spread, in units of degrees and mm, and the level of the cost.
struct Round {
  double spread, spacing_px, reach_px;
};
constexpr Round kRounds[] = {{1, 4, 12}, {0.7, 2, 6}, {0.5, 2, 6}};

/// The minimum of the quadratic function that fits best to a cost at many poses around one, in the units of `spread`.
/// A contour's cost is rough: a search would end at any of many places beside each other, by the last digits of where
/// it began. The fit looks over the rough ground.
Vector6d minimum_of_fit(const Judged& judged, const Cost& cost, const RigidTransform& around, const Vector6d& spread) {
  constexpr double kLeastCurvature = 0.05, kFarthest = 2;
  Random random(1);
  Eigen::MatrixXd terms(kPoses, kTerms);
  std::vector<RigidTransform> poses;
  for (int i = 0; i < kPoses; ++i) {
    Vector6d u;
    for (double& one : u) one = random.normal();
    poses.push_back(judged.moved_by(around, u.cwiseProduct(spread)));
    terms(i, 0) = 1;
    terms.row(i).segment<6>(1) = u.transpose();
    for (int a = 0, term = 7; a < 6; ++a)
      for (int b = 0; b <= a; ++b) terms(i, term++) = u[a] * u[b];
  }
  const std::vector<double> values = cost.values(poses);
  const Eigen::VectorXd fit =
      terms.colPivHouseholderQr().solve(Eigen::Map<const Eigen::VectorXd>(values.data(), kPoses));
  const Vector6d slope = fit.segment<6>(1);
  Matrix6d curvature = Matrix6d::Zero();
  for (int a = 0, term = 7; a < 6; ++a)
    for (int b = 0; b <= a; ++b, ++term) {
      curvature(a, b) += fit[term];
      curvature(b, a) += fit[term];
    }
  const SymmetricEigen<6> eigen = eigen_of_symmetric(curvature);
  if (!(eigen.values[5] > 0)) return slope.norm() > 0 ? Vector6d(-kFarthest * slope.normalized()) : Vector6d::Zero();
  Vector6d way = Vector6d::Zero();
  for (int k = 0; k < 6; ++k)
    way -= eigen.vectors.col(k) * eigen.vectors.col(k).dot(slope) /
           std::max(eigen.values[k], kLeastCurvature * eigen.values[5]);
  return way.allFinite() ? Vector6d(way * std::min(1.0, kFarthest / std::max(way.norm(), 1e-12))) : Vector6d::Zero();
}

}  // namespace

Apart second_cost(const Judged& judged, const Cost& cost) {
  Vector6d unit;
  unit << 1, 1, 2, 1, 1, 1;  // degrees and mm: a slender bone is turned far about its long axis
  RigidTransform there = judged.pose.world_from_model;
  for (const Round& round : kRounds) {
    const auto level = cost.at_level({round.spacing_px, round.reach_px, 0});
    const Vector6d spread = round.spread * unit;
    there = judged.moved_by(there, minimum_of_fit(judged, *level, there, spread).cwiseProduct(spread));
  }
  return {judged.off_mm(there), judged.axial_deg(there)};
}

}  // namespace marrow::verdict
