// SPDX-License-Identifier: Apache-2.0
#include "predicted_covariance.hpp"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <set>

#include "marrow/domain/decompositions.hpp"

namespace marrow::search {
namespace {

/// If only one or two blocks of the images say something about a pose, nothing tells how far the minimum would move
/// without them, so the jackknife predicts no deviations.
constexpr std::size_t kFewBlocks = 2;

/// The blocks that change the cost when they are left out.
inline std::set<Eigen::Index> blocks_that_speak(const Eigen::VectorXd& without_block, double whole) {
  constexpr double kRounding = 1e-9;  // relative, of sums from which those of a block are taken away
  std::set<Eigen::Index> speak;
  for (Eigen::Index i = 0; i < without_block.size(); ++i)
    if (!(std::abs(without_block[i] - whole) <= kRounding * std::max(std::abs(without_block[i]), std::abs(whole))))
      speak.insert(i);
  return speak;
}

/// Their number, by derivatives: without any of the other blocks the expansion is the same.
inline std::size_t count_of_blocks_that_speak(const std::vector<Cost::Expansion>& without_block) {
  std::map<double, int> alike;
  for (const Cost::Expansion& one : without_block) ++alike[one.curvature.sum() + one.gradient.sum()];
  return std::size_t(std::count_if(alike.begin(), alike.end(), [](const auto& one) { return one.second == 1; }));
}

constexpr double kLeastStep = 1.0 / 256;                                            // degrees or mm
constexpr double kLeastRise = 0.5, kGoodRise = 1, kAimedRise = 1.7, kMostRise = 3;  // in units of the wanted rise
constexpr double kFlat = 0.1, kFlatLater = 0.5;  // in units of the wanted rise: the least curvature along a step
constexpr double kWantedRise = 10;               // of the cost by a step, in units of its noise
constexpr int kMostRounds = 5;
constexpr double kMostVariance = 100 * 100;  // in squared steps; used for directions that nothing determines

}  // namespace

RigidTransform moved_by_units(const RigidTransform& pose, const FragmentFrame& frame, const Vector6d& deg_and_mm) {
  Vector6d motion = deg_and_mm;
  motion.head<3>() *= radians(1);
  return moved(pose, frame, motion);
}

PredictedCovariance::PredictedCovariance(const Cost& cost, const RigidTransform& pose, const FragmentFrame& frame,
                                         const Cost* coarser)
    : cost_(cost), coarser_(coarser), pose_(pose), frame_(frame) {
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
    // Directions that are still open after the first round have no curvature.
    const auto left_out = round > 1 ? std::count(open_.begin(), open_.end(), true) : 0;
    const double least_curvature = eigen_of_symmetric(h).values[left_out] / wanted_rise_, wanted_before = wanted_rise_;
    wanted_rise_ = std::min(wanted_rise_, kWantedRise * noise_);
    const bool steps_are_right = !close_again() && wanted_rise_ > 0.5 * wanted_before && least_curvature > kFlatLater;
    if (steps_are_right || round == kMostRounds) {
      move_without_each_block(at_diagonals, flat);
      break;
    }
    turn_steps(h);
  }
  widen();
}

/// Whether only one or two blocks change the cost when they are left out, at the pose and near it. Then nothing tells
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

/// Sets the covariance from the cost's own derivatives. Returns false, and sets nothing, if the cost has none or they
/// say little: a direction is nearly flat over many degrees or millimetres, or flat without one of the blocks; only one
/// or two blocks count; or the cost does not rise as the derivatives say.
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

/// Takes first steps from the curvature of the cost. They are nearly right, which saves most of the search.
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

/// Changes a step that is too long or too short to the length that fits a parabola, by a factor of 8 at most.
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

/// Directions count as flat before the noise is known. The first guess of it takes in all blocks, also those that show
/// other bones and say nothing about this one. So a direction along which the cost does rise by more than its noise is
/// not open after all. Returns whether there is one.
bool PredictedCovariance::close_again() {
  bool any = false;
  for (std::size_t i = 0; i < 6; ++i)
    if (open_[i] && rises_[Eigen::Index(i)] > kLeastRise * wanted_rise_) open_[i] = false, any = true;
  return any;
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

/// The Hessian of the mean cost without a block.
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
/// blocks have in common is taken away: it is the slope of the whole cost, which is 0 at a minimum.
Eigen::Matrix<double, Eigen::Dynamic, 6> PredictedCovariance::gradients() const {
  Eigen::Matrix<double, Eigen::Dynamic, 6> gradients(at_pose_.size(), 6);
  for (int axis = 0; axis < 6; ++axis) {
    const Eigen::VectorXd slope = 0.5 * (at_ends_[std::size_t(2 * axis)] - at_ends_[std::size_t(2 * axis + 1)]);
    gradients.col(axis) = slope.array() - slope.mean();
  }
  return gradients;
}

/// Turns the steps to the eigenvectors of the Hessian. Open directions stay open.
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
  constexpr double kNone = 1e-6;  // degrees or mm; no images determine a pose so exactly
  if (in_units_.diagonal().maxCoeff() < kNone * kNone) in_units_.diagonal().setConstant(kLeastStep * kLeastStep);
  // A deviation of hundreds of degrees or millimetres means that nothing is known, however large it is.
  const Vector6d most = Vector6d::Constant(kMostVariance * kMostStep * kMostStep);
  const Vector6d share = most.cwiseQuotient(in_units_.diagonal().cwiseMax(most)).cwiseSqrt();
  in_units_ = (share.asDiagonal() * in_units_ * share.asDiagonal()).eval();
  Vector6d unit = Vector6d::Ones();
  unit.head<3>() *= radians(1);
  covariance_ = unit.asDiagonal() * (in_units_ + undetermined) * unit.asDiagonal();
  for (int axis = 0; axis < 6; ++axis)
    undetermined_[std::size_t(axis)] = undetermined(axis, axis) > in_units_(axis, axis);
}

}  // namespace marrow::search
