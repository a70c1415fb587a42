// SPDX-License-Identifier: Apache-2.0
// How the cost runs along a line through the pose, farther than its derivatives tell, and what is said of
// that.
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "marrow/base/number_text.hpp"
#include "marrow/domain/decompositions.hpp"
#include "predicted_covariance.hpp"

namespace marrow::search {
namespace {

constexpr int kLong = 2;              // the rotation about the long axis
constexpr double kMattersBelow = 12;  // rise of a cost along a line, in units of its noise

/// The six axes in words. Only of a bone's own axes is known which is the long one.
std::array<std::string, 6> names_of_axes(const FragmentFrame& frame) {
  if (frame.is_anatomical)
    return {"rotation about the frontal axis",    "rotation about the lateral axis",    "axial rotation",
            "translation along the frontal axis", "translation along the lateral axis", "axial translation"};
  return {"rotation about the x axis",    "rotation about the y axis",    "rotation about the z axis",
          "translation along the x axis", "translation along the y axis", "translation along the z axis"};
}

/// A sentence if the rotation about a direction between the axes is less certain than about all of them, as that about
/// a bone's long axis may be, and less than `most_deg`. Else empty.
std::string warning_between_axes(const Matrix6d& covariance, double most_deg) {
  constexpr double kLonger = 1.1;
  const SymmetricEigen<3> eigen = eigen_of_symmetric<3>(covariance.topLeftCorner<3, 3>());
  const double worst_deg = degrees(std::sqrt(std::max(0.0, eigen.values[2]))),
               of_axes_deg = degrees(std::sqrt(covariance.diagonal().head<3>().maxCoeff()));
  if (worst_deg <= std::max(most_deg, kLonger * of_axes_deg)) return "";
  const Eigen::Vector3d along = eigen.vectors.col(2) * (eigen.vectors.col(2).sum() < 0 ? -1 : 1);
  return formatted(
      "rotation about the direction ({:.3g}, {:.3g}, {:.3g}) is poorly determined by these images: its predicted "
      "standard deviation is {:.3g} degrees",
      along.x(), along.y(), along.z(), worst_deg);
}

}  // namespace

/// Widens the covariance along the eigenvector of the largest eigenvalue, and for turns about the long axis. A short
/// bone is nearly round. So there may be another minimum some deviations beside this one about the long axis, even
/// where another direction is less certain. Where the cost has derivatives, look_around() sees to that.
void PredictedCovariance::widen() {
  constexpr double kSameWay = 0.9;  // cosine
  const SymmetricEigen<6> eigen = eigen_of_symmetric(in_units_);
  widen_along(eigen.vectors.col(5), eigen.values[5]);
  if (!is_by_derivatives_ && std::abs(eigen.vectors(kLong, 5)) < kSameWay)
    widen_along(Vector6d::Unit(kLong), in_units_(kLong, kLong));
}

/// Widens the covariance by the density exp(-cost / noise) along a direction in which it has this variance, out to
/// twelve standard deviations.
void PredictedCovariance::widen_along(const Vector6d& direction, double variance) {
  constexpr int kSide = 12;
  constexpr double kReach = 12;
  constexpr double kLeastRatio = 2;  // of the variances; less is the roughness of the cost
  if (!(variance > 0) || !(noise_ > 0)) return;
  const double step = std::min(kReach * std::sqrt(variance), kMostStep) / kSide;
  const std::vector<RigidTransform> poses = line(direction, step, kSide);
  const std::vector<double> values = values_along(poses);
  find_other_minima(poses, values);
  const double of_density = variance_of_density(values, step);
  if (of_density < kLeastRatio * variance) return;
  Vector6d unit = direction;
  unit.head<3>() *= radians(1);
  *covariance_ += (of_density - variance) * unit * unit.transpose();
}

/// The same for turns about the long axis, out to the longest step. Derivatives describe one place only, but for a body
/// of revolution only the facets make the minimum, and there are others all around.
void PredictedCovariance::look_around() {
  constexpr double kLeastStep_deg = 0.25, kLeastRatio = 2;
  if (!(noise_ > 0)) return;
  const int side = int(kMostStep / std::max(std::sqrt(in_units_(kLong, kLong)), kLeastStep_deg)) / 2 * 2;
  const double step = kMostStep / std::max(side, 1);
  const double of_density = variance_of_density(values_along(line(Vector6d::Unit(kLong), step, side)), step);
  const double now = (*covariance_)(kLong, kLong) * degrees(1) * degrees(1);
  if (of_density < kLeastRatio * now) return;
  (*covariance_)(kLong, kLong) = of_density * radians(1) * radians(1);
}

/// Poses along a direction, `side` to either side of the pose.
std::vector<RigidTransform> PredictedCovariance::line(const Vector6d& direction, double step, int side) const {
  std::vector<RigidTransform> poses;
  for (int i = -side; i <= side; ++i) poses.push_back(pose_at(i * step * direction));
  return poses;
}

/// The variance, about the pose, of the density exp(-cost / noise) at the poses of line().
double PredictedCovariance::variance_of_density(const std::vector<double>& values, double step) const {
  const int side = int(values.size()) / 2;
  double sum = 0, squares = 0;
  for (int i = -side; i <= side; ++i) {
    const double density = std::exp(-std::max(0.0, values[std::size_t(i + side)] - value_) / noise_);
    sum += density;
    squares += density * (i * step) * (i * step);
  }
  return squares / sum;
}

/// Every second pose of a line, but for those where the coarser cost, if there is one, is far above that of the pose.
std::vector<std::size_t> PredictedCovariance::worth_computing(const std::vector<RigidTransform>& poses) const {
  constexpr double kFarAbove = 2 * kMattersBelow;  // the costs of two levels differ
  std::vector<std::size_t> chosen;
  for (std::size_t i = 0; i < poses.size(); i += 2) chosen.push_back(i);
  if (!coarser_) return chosen;
  std::vector<RigidTransform> at{pose_};
  for (const std::size_t i : chosen) at.push_back(poses[i]);
  const std::vector<double> values = coarser_->values(at);
  std::size_t next = 0;
  std::erase_if(chosen, [&](std::size_t) { return values[++next] - values[0] > kFarAbove * noise_; });
  return chosen;
}

/// The cost at poses on a line, a standard deviation or less apart. Every second one is computed first. Those between
/// are computed only beside a cost that could matter, and are infinite elsewhere.
std::vector<double> PredictedCovariance::values_along(const std::vector<RigidTransform>& poses) {
  std::vector<double> values(poses.size(), std::numeric_limits<double>::infinity());
  const auto compute = [&](const std::vector<std::size_t>& chosen) {
    std::vector<RigidTransform> at;
    for (const std::size_t i : chosen) at.push_back(poses[i]);
    const std::vector<double> computed = cost_.values(at);
    for (std::size_t k = 0; k < chosen.size(); ++k) values[chosen[k]] = computed[k];
    evaluations_ += int(chosen.size());
  };
  std::vector<std::size_t> chosen = worth_computing(poses);
  compute(chosen);
  chosen.clear();
  for (std::size_t i = 1; i + 1 < poses.size(); i += 2)
    if (std::min(values[i - 1], values[i + 1]) < value_ + kMattersBelow * noise_) chosen.push_back(i);
  compute(chosen);
  return values;
}

/// `poses`: on a line, a standard deviation or less apart, with the pose itself in the middle.
void PredictedCovariance::find_other_minima(const std::vector<RigidTransform>& poses,
                                            const std::vector<double>& values) {
  constexpr std::size_t kMost = 2;
  constexpr int kNear = 1;          // poses at both sides that belong to the pose's own minimum
  constexpr double kMostRise = 10;  // in units of the cost's noise
  static_assert(kMostRise < kMattersBelow);
  const int count = int(values.size()), middle = count / 2;
  std::vector<int> found;
  for (int i = 1; i + 1 < count; ++i) {
    const double here = values[std::size_t(i)];
    if (std::abs(i - middle) > kNear && here < values[std::size_t(i - 1)] && here <= values[std::size_t(i + 1)] &&
        here < value_ + kMostRise * noise_)
      found.push_back(i);
  }
  std::sort(found.begin(), found.end(), [&](int a, int b) { return values[std::size_t(a)] < values[std::size_t(b)]; });
  for (std::size_t i = 0; i < std::min(kMost, found.size()); ++i) other_minima_.push_back(poses[std::size_t(found[i])]);
}

std::vector<std::string> PredictedCovariance::warnings(double most_deg, double most_mm) const {
  const std::array<std::string, 6> axes = names_of_axes(frame_);
  if (has_few_blocks_)
    return {
        "all that the images say about the pose lies in one or two small parts of them, so its deviations are not "
        "known"};
  std::vector<std::string> warnings;
  for (int axis = 0; axis < 6 && covariance_; ++axis) {
    const bool turn = axis < 3;
    const double sd = std::sqrt((*covariance_)(axis, axis)), shown = turn ? degrees(sd) : sd;
    if (shown <= (turn ? most_deg : most_mm)) continue;
    if (undetermined_[std::size_t(axis)])
      warnings.push_back(formatted("{} is not determined by these images: the cost hardly changes within {:.3g}{}",
                                   axes[std::size_t(axis)], kMostStep, turn ? " degrees" : " mm"));
    else
      warnings.push_back(
          formatted("{} is poorly determined by these images: its predicted standard deviation is {:.3g}{}",
                    axes[std::size_t(axis)], shown, turn ? " degrees" : " mm"));
  }
  if (!frame_.is_anatomical && covariance_)
    if (std::string between = warning_between_axes(*covariance_, most_deg); !between.empty())
      warnings.push_back(std::move(between));
  return warnings;
}

}  // namespace marrow::search
