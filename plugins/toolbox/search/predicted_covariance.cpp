// SPDX-License-Identifier: Apache-2.0
#include "predicted_covariance.hpp"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "marrow/domain/decompositions.hpp"
#include "speaking_blocks.hpp"

namespace marrow::search {
namespace {

constexpr double kLeastStep = 1.0 / 256;                                            // degrees or mm
constexpr double kLeastRise = 0.5, kGoodRise = 1, kAimedRise = 1.7, kMostRise = 3;  // in units of the wanted rise
constexpr double kFlat = 0.1, kFlatLater = 0.5;  // in units of the wanted rise: the least curvature along a step
constexpr double kWantedRise = 10;               // of the cost by a step, in units of its noise
constexpr int kMostRounds = 5;
constexpr double kMostVariance = 100 * 100;  // in squared steps; used for directions that nothing determines
constexpr double kMattersBelow = 12;         // rise of a cost along the least certain direction, in units of its noise

}  // namespace

RigidTransform moved_by_units(const RigidTransform& pose, const FragmentFrame& frame, const Vector6d& deg_and_mm) {
  Vector6d motion = deg_and_mm;
  motion.head<3>() *= radians(1);
  return moved(pose, frame, motion);
}

PredictedCovariance::PredictedCovariance(const Cost& cost, const RigidTransform& pose, const FragmentFrame& frame)
    : cost_(cost), pose_(pose), frame_(frame) {
  value_ = cost.value(pose);
  ++evaluations_;
  if (differentiate()) {
    widen();
    look_around();
    return;
  }
  at_pose_ = blocks_at(pose);
  if (at_pose_.size() == 0) return;
  ++evaluations_;
  if (rests_on_few_blocks()) {
    set_unknown();
    return;
  }
  wanted_rise_ = std::sqrt((at_pose_.array() - value_).square().sum());  // the standard deviation of the cost's value
  if (wanted_rise_ == 0) {
    set_exact();
    return;
  }
  guess_steps();
  for (int round = 1;; ++round) {
    choose_steps();
    const Eigen::MatrixXd at_diagonals = without_each_block(diagonals());
    const Matrix6d h = hessian(at_diagonals);
    const auto gradient = gradients();
    const double flat = round == 1 ? kFlat : kFlatLater;
    noise_ = (inverse(h, flat) * gradient.transpose() * gradient).trace() / 6;
    const bool is_flat = std::all_of(open_.begin(), open_.end(), [](bool open) { return open; });
    if (is_flat) {
      move_without_each_block(at_diagonals, flat);
      return;
    }
    if (noise_ == 0) {
      set_exact();
      return;
    }
    // After the first round, those directions that are still open have no curvature to look at.
    const auto left_out = round > 1 ? std::count(open_.begin(), open_.end(), true) : 0;
    const double least_curvature = eigen_of_symmetric(h).values[left_out] / wanted_rise_, wanted_before = wanted_rise_;
    wanted_rise_ = std::min(wanted_rise_, kWantedRise * noise_);
    const bool steps_are_right = wanted_rise_ > 0.5 * wanted_before && least_curvature > kFlatLater;
    if (steps_are_right || round == kMostRounds) {
      move_without_each_block(at_diagonals, flat);
      break;
    }
    turn_steps(h);
  }
  widen();
}

/// Whether leaving out a block changes the cost for one or two blocks only, at the pose and near it. Then nothing tells
/// how far the minimum would move without them. Nearly always the pose itself is enough.
bool PredictedCovariance::rests_on_few_blocks() {
  std::set<Eigen::Index> speak = blocks_that_speak(at_pose_, value_);
  for (const double step : {0.5, 4.0})
    for (int axis = 0; axis < 6; ++axis)
      for (const double sense : {1.0, -1.0}) {
        if (speak.size() > kFewBlocks) return false;
        const RigidTransform there = pose_at(sense * step * Vector6d::Unit(axis));
        speak.merge(blocks_that_speak(blocks_at(there), cost_.value(there)));
        evaluations_ += 2;
      }
  return speak.size() <= kFewBlocks;
}

void PredictedCovariance::set_unknown() {
  has_few_blocks_ = true;
  in_units_.setZero();
  set_covariance(kMostVariance * kMostStep * kMostStep * Matrix6d::Identity());
}

/// Whether a Hessian determines all six axes.
bool PredictedCovariance::is_regular(const Matrix6d& hessian) {
  constexpr double kRounding = 1e-12;
  const Vector6d eigenvalues = eigen_of_symmetric(hessian).values;
  return eigenvalues[0] > kRounding * eigenvalues[5];
}

/// By the cost's own derivatives, where it has them. They say little if a direction is nearly flat over many degrees or
/// millimetres, or flat without one of the blocks, or if only one or two blocks count, or if the cost does not rise as
/// they say. Then nothing is set, and the result is false.
bool PredictedCovariance::differentiate() {
  constexpr double kMostDeviation = 8;  // degrees or mm
  const std::vector<Cost::Expansion> without_block = cost_.expansion_without_each_block(pose_, frame_);
  const auto whole = cost_.expansion(pose_, frame_);
  if (without_block.empty() || !whole) return false;
  evaluations_ += 2;
  if (count_of_blocks_that_speak(without_block) <= kFewBlocks) return false;
  Vector6d unit = Vector6d::Ones();
  unit.head<3>() *= radians(1);
  Matrix6d sum = Matrix6d::Zero(), mean = Matrix6d::Zero();
  for (const Cost::Expansion& without : without_block) {
    const Matrix6d h = unit.asDiagonal() * without.curvature * unit.asDiagonal();
    if (!is_regular(h)) return false;
    const Vector6d g = unit.cwiseProduct(without.gradient - whole->gradient), motion = solve_symmetric<6>(h, g);
    sum += motion * motion.transpose();
    mean += h / double(without_block.size());
  }
  if (!sum.allFinite() || sum.diagonal().maxCoeff() > kMostDeviation * kMostDeviation) return false;
  if (!rises_as_derivatives_say(mean, sum)) return false;
  noise_ = (mean * sum).trace() / 6;
  in_units_ = sum;
  set_covariance(Matrix6d::Zero());
  is_by_derivatives_ = true;
  return true;
}

/// Whether the cost rises along each eigenvector of the covariance, four deviations to both sides, by a quarter at
/// least of what its curvature says. About the axis of a body of revolution the slopes of single facets give a
/// curvature, but all turns cost the same.
bool PredictedCovariance::rises_as_derivatives_say(const Matrix6d& hessian, const Matrix6d& covariance) {
  constexpr double kDeviations = 4, kLeastShare = 0.25;
  const SymmetricEigen<6> eigen = eigen_of_symmetric(covariance);
  std::vector<RigidTransform> poses;
  Vector6d expected;
  for (int i = 0; i < 6; ++i) {
    const Vector6d motion = kDeviations * std::sqrt(std::max(eigen.values[i], 0.0)) * eigen.vectors.col(i);
    expected[i] = 0.5 * motion.dot(hessian * motion);
    for (const double sense : {1.0, -1.0}) poses.push_back(pose_at(sense * motion));
  }
  const std::vector<double> values = cost_.values(poses);
  evaluations_ += int(poses.size());
  for (std::size_t i = 0; i < 6; ++i)
    if (0.5 * (values[2 * i] + values[2 * i + 1]) - value_ < kLeastShare * expected[Eigen::Index(i)]) return false;
  return true;
}

/// No block moves the minimum, so the fit is perfect. But an axis along which even the longest step costs nothing is
/// not known at all.
void PredictedCovariance::set_exact() {
  in_units_.setZero();
  Matrix6d undetermined = Matrix6d::Zero();
  for (int axis = 0; axis < 6; ++axis) {
    const Vector6d step = kMostStep * Vector6d::Unit(axis);
    const bool rises = cost_.value(pose_at(step)) > value_ || cost_.value(pose_at(-step)) > value_;
    if (!rises) undetermined(axis, axis) = kMostVariance * kMostStep * kMostStep;
    evaluations_ += 2;
  }
  set_covariance(undetermined);
}

/// Steps that are nearly right save most of the search for them.
void PredictedCovariance::guess_steps() {
  const auto about = cost_.expansion(pose_, frame_);
  if (!about) return;
  ++evaluations_;
  for (int axis = 0; axis < 6; ++axis) {
    const double unit = axis < 3 ? radians(1) : 1, curvature = about->curvature(axis, axis) * unit * unit;
    if (!(curvature > 0)) continue;
    const double step = std::sqrt(2 * kAimedRise * wanted_rise_ / curvature);
    steps_(axis, axis) = std::clamp(step, kLeastStep, kMostStep);
  }
}

/// A step that is too long or too short gets the length that a parabola would have, at most eight times less or more.
void PredictedCovariance::choose_steps() {
  constexpr double kMostChange = 8;
  std::array<int, 6> evaluations{};
  tbb::parallel_for(0, 6, [&](int i) {
    if (open_[std::size_t(i)]) return;
    Vector6d step = steps_.col(i);
    std::array<Eigen::VectorXd, 2> ends;
    const auto rise = [&] {
      evaluations[std::size_t(i)] += 2;
      for (const std::size_t end : {0u, 1u}) ends[end] = blocks_at(pose_at(end ? -step : step));
      return 0.5 * (ends[0].mean() + ends[1].mean()) - at_pose_.mean();
    };
    const auto change = [&](double height) {
      return std::clamp(std::sqrt(kAimedRise * wanted_rise_ / std::max(height, 1e-12 * wanted_rise_)), 1 / kMostChange,
                        kMostChange);
    };
    double height = rise();
    for (; height > kMostRise * wanted_rise_ && step.cwiseAbs().maxCoeff() > kLeastStep; height = rise())
      step *= std::max(change(height), kLeastStep / step.cwiseAbs().maxCoeff());
    for (; height < kGoodRise * wanted_rise_ && step.cwiseAbs().maxCoeff() < kMostStep; height = rise())
      step *= std::min(change(height), kMostStep / step.cwiseAbs().maxCoeff());
    steps_.col(i) = step;
    rises_[i] = height;
    at_ends_[std::size_t(2 * i)] = ends[0], at_ends_[std::size_t(2 * i + 1)] = ends[1];
    open_[std::size_t(i)] = height <= kLeastRise * wanted_rise_;
  });
  for (const int count : evaluations) evaluations_ += count;
}

/// Both ends of the diagonal of each two axes.
std::vector<RigidTransform> PredictedCovariance::diagonals() const {
  std::vector<RigidTransform> poses;
  for (int i = 0; i < 6; ++i)
    for (int j = 0; j < i; ++j)
      for (const double sense : {1.0, -1.0}) poses.push_back(pose_at(sense * (steps_.col(i) + steps_.col(j))));
  return poses;
}

/// The Hessian in units of the steps. A mixed second derivative is the mean rise along the diagonal of two axes, in
/// both senses, minus the rises along the two axes.
Matrix6d PredictedCovariance::hessian_of(double value, const Vector6d& rises,
                                         const Eigen::VectorXd& at_diagonals) const {
  Matrix6d h;
  Eigen::Index end = 0;
  for (int i = 0; i < 6; ++i) {
    h(i, i) = 2 * rises[i];
    for (int j = 0; j < i; ++j, end += 2)
      h(i, j) = h(j, i) = 0.5 * (at_diagonals[end] + at_diagonals[end + 1]) - value - rises[i] - rises[j];
  }
  for (int i = 0; i < 6; ++i)
    if (open_[std::size_t(i)]) h.row(i).setZero(), h.col(i).setZero();
  return h;
}

/// Of the mean cost without a block.
Matrix6d PredictedCovariance::hessian(const Eigen::MatrixXd& at_diagonals) const {
  return hessian_of(at_pose_.mean(), rises_, at_diagonals.colwise().mean());
}

Eigen::VectorXd PredictedCovariance::blocks_at(const RigidTransform& pose) const {
  const std::vector<double> values = cost_.without_each_block(pose);
  return Eigen::Map<const Eigen::VectorXd>(values.data(), Eigen::Index(values.size()));
}

/// Values without each block at all poses: in each row those of one block.
Eigen::MatrixXd PredictedCovariance::without_each_block(const std::vector<RigidTransform>& poses) {
  Eigen::MatrixXd rows(at_pose_.size(), Eigen::Index(poses.size()));
  tbb::parallel_for(std::size_t(0), poses.size(),
                    [&](std::size_t i) { rows.col(Eigen::Index(i)) = blocks_at(poses[i]); });
  evaluations_ += int(poses.size());
  return rows;
}

/// The gradients, in units of the steps, of the changes that leaving out a block makes. One block in each row. What all
/// blocks have in common is the slope of the whole cost, which is none at a minimum.
Eigen::Matrix<double, Eigen::Dynamic, 6> PredictedCovariance::gradients() const {
  Eigen::Matrix<double, Eigen::Dynamic, 6> gradients(at_pose_.size(), 6);
  for (int axis = 0; axis < 6; ++axis) {
    const Eigen::VectorXd slope = 0.5 * (at_ends_[std::size_t(2 * axis)] - at_ends_[std::size_t(2 * axis + 1)]);
    gradients.col(axis) = slope.array() - slope.mean();
  }
  return gradients;
}

/// The next steps go along the eigenvectors of the Hessian, which keep the directions that are open.
void PredictedCovariance::turn_steps(const Matrix6d& hessian) {
  const SymmetricEigen<6> eigen = eigen_of_symmetric(hessian);
  const std::array<bool, 6> were_open = open_;
  Vector6d length;
  for (int i = 0; i < 6; ++i) {
    length[i] = std::sqrt(2 * kAimedRise * wanted_rise_ / std::max(eigen.values[i], kFlat * wanted_rise_));
    double share = 0;
    for (int k = 0; k < 6; ++k) share += were_open[std::size_t(k)] ? eigen.vectors(k, i) * eigen.vectors(k, i) : 0;
    open_[std::size_t(i)] = share > 0.5;
  }
  steps_ = (steps_ * eigen.vectors * length.asDiagonal()).eval();
  for (int i = 0; i < 6; ++i)
    steps_.col(i) *=
        std::clamp(steps_.col(i).cwiseAbs().maxCoeff(), kLeastStep, kMostStep) / steps_.col(i).cwiseAbs().maxCoeff();
}

/// The inverse in the directions that are not open. After the first round the steps are nearly eigenvectors, so a
/// smaller curvature than `flat` is roughness.
Matrix6d PredictedCovariance::inverse(const Matrix6d& hessian, double flat) const {
  const SymmetricEigen<6> eigen = eigen_of_symmetric(hessian);
  Matrix6d inverse = Matrix6d::Zero();
  for (int i = 0; i < 6; ++i)
    inverse += eigen.vectors.col(i) * eigen.vectors.col(i).transpose() / std::max(eigen.values[i], flat * wanted_rise_);
  for (int i = 0; i < 6; ++i)
    if (open_[std::size_t(i)]) inverse.row(i).setZero(), inverse.col(i).setZero();
  return inverse;
}

void PredictedCovariance::move_without_each_block(const Eigen::MatrixXd& at_diagonals, double flat) {
  const auto gradient = gradients();
  Matrix6d sum = Matrix6d::Zero();
  for (Eigen::Index block = 0; block < at_pose_.size(); ++block) {
    Vector6d rises;
    for (int axis = 0; axis < 6; ++axis)
      rises[axis] =
          0.5 * (at_ends_[std::size_t(2 * axis)][block] + at_ends_[std::size_t(2 * axis + 1)][block]) - at_pose_[block];
    const Matrix6d h = hessian_of(at_pose_[block], rises, at_diagonals.row(block));
    const Vector6d motion = inverse(h, flat) * gradient.row(block).transpose();
    sum += motion * motion.transpose();
  }
  in_units_ = steps_ * sum * steps_.transpose();
  Matrix6d open = Matrix6d::Zero();
  for (int i = 0; i < 6; ++i)
    if (open_[std::size_t(i)]) open(i, i) = kMostVariance;
  set_covariance(steps_ * open * steps_.transpose());
}

void PredictedCovariance::set_covariance(const Matrix6d& undetermined) {
  constexpr double kNone = 1e-6;  // degrees or mm; no images tell as little
  if (in_units_.diagonal().maxCoeff() < kNone * kNone) in_units_.diagonal().setConstant(kLeastStep * kLeastStep);
  // What is known to hundreds of degrees or millimetres is not known, however large the number.
  const Vector6d most = Vector6d::Constant(kMostVariance * kMostStep * kMostStep);
  const Vector6d share = most.cwiseQuotient(in_units_.diagonal().cwiseMax(most)).cwiseSqrt();
  in_units_ = (share.asDiagonal() * in_units_ * share.asDiagonal()).eval();
  Vector6d unit = Vector6d::Ones();
  unit.head<3>() *= radians(1);
  covariance_ = unit.asDiagonal() * (in_units_ + undetermined) * unit.asDiagonal();
  for (int axis = 0; axis < 6; ++axis)
    undetermined_[std::size_t(axis)] = undetermined(axis, axis) > in_units_(axis, axis);
}

/// The density exp(-cost / noise) along the eigenvector of the largest eigenvalue, out to twelve standard deviations.
void PredictedCovariance::widen() {
  constexpr int kSide = 12;
  constexpr double kReach = 12;
  constexpr double kLeastRatio = 2;  // of the variances; less is the roughness of the cost
  const SymmetricEigen<6> eigen = eigen_of_symmetric(in_units_);
  const double variance = eigen.values[5];
  if (!(variance > 0) || !(noise_ > 0)) return;
  const double step = std::min(kReach * std::sqrt(variance), kMostStep) / kSide;
  const std::vector<RigidTransform> poses = line(eigen.vectors.col(5), step, kSide);
  const std::vector<double> values = values_along(poses);
  find_other_minima(poses, values);
  const double of_density = variance_of_density(values, step);
  if (of_density < kLeastRatio * variance) return;
  Vector6d unit = eigen.vectors.col(5);
  unit.head<3>() *= radians(1);
  *covariance_ += (of_density - variance) * unit * unit.transpose();
}

/// The same for turns about the long axis, out to the longest step. Derivatives are of one place, but about the axis of
/// a body of revolution facets alone make the minimum, and others lie all around.
void PredictedCovariance::look_around() {
  constexpr int kLong = 2;
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

/// About the pose, of the density exp(-cost / noise) at the poses of line().
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

/// The cost at poses on a line, a standard deviation or less apart. Every second comes first. Those between are
/// computed only beside a cost that could matter, and are infinite elsewhere.
std::vector<double> PredictedCovariance::values_along(const std::vector<RigidTransform>& poses) {
  std::vector<double> values(poses.size(), std::numeric_limits<double>::infinity());
  const auto compute = [&](const std::vector<std::size_t>& chosen) {
    std::vector<RigidTransform> at;
    for (const std::size_t i : chosen) at.push_back(poses[i]);
    const std::vector<double> computed = cost_.values(at);
    for (std::size_t k = 0; k < chosen.size(); ++k) values[chosen[k]] = computed[k];
    evaluations_ += int(chosen.size());
  };
  std::vector<std::size_t> chosen;
  for (std::size_t i = 0; i < poses.size(); i += 2) chosen.push_back(i);
  compute(chosen);
  chosen.clear();
  for (std::size_t i = 1; i + 1 < poses.size(); i += 2)
    if (std::min(values[i - 1], values[i + 1]) < value_ + kMattersBelow * noise_) chosen.push_back(i);
  compute(chosen);
  return values;
}

/// `poses` lie on a line through the pose, which is in the middle, a standard deviation or less apart.
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

}  // namespace marrow::search
