// SPDX-License-Identifier: Apache-2.0
#pragma once
// A cost with exactly known Hessian, derivatives and noise, and an optimizer that only records its problems.
#include <marrow/domain/decompositions.hpp>
#include <marrow/domain/functions.hpp>
#include <vector>

#include "well.hpp"

namespace well {

/// way . hessian way / 2, of the way from the bottom in degrees and mm about the frame.
class Bowl : public marrow::Cost {
 public:
  Bowl(marrow::RigidTransform bottom, marrow::FragmentFrame frame, const marrow::Matrix6d& hessian,
       double information = 1)
      : bottom_(std::move(bottom)), frame_(std::move(frame)), hessian_(hessian) {
    const marrow::SymmetricEigen<6> eigen = marrow::eigen_of_symmetric(hessian);
    for (int i = 0; i < 6; ++i)
      slopes_.push_back(std::sqrt(0.5 * std::max(eigen.values[i], 0.0) / information) * eigen.vectors.col(i));
  }

  double value(const marrow::RigidTransform& pose) const override {
    const marrow::Vector6d motion = way(bottom_, pose, frame_);
    return 0.5 * motion.dot(hessian_ * motion);
  }
  std::shared_ptr<const marrow::Cost> at_level(const marrow::CostLevel& level) const override {
    levels.push_back(level);
    return std::make_shared<Bowl>(*this);
  }
  /// Twelve blocks. Without each of them the bowl is higher, and tilted to one side along one of its eigenvectors, so
  /// much that its covariance is the inverse of information * hessian. All of them together do not tilt it.
  std::vector<double> without_each_block(const marrow::RigidTransform& pose) const override {
    const marrow::Vector6d motion = way(bottom_, pose, frame_);
    std::vector<double> values;
    for (const marrow::Vector6d& slope : slopes_)
      for (const double side : {-1, 1}) values.push_back(value(pose) + 0.1 + side * slope.dot(motion));
    return values;
  }

  mutable std::vector<marrow::CostLevel> levels;

 private:
  marrow::RigidTransform bottom_;
  marrow::FragmentFrame frame_;
  marrow::Matrix6d hessian_;
  std::vector<marrow::Vector6d> slopes_;
};

/// Notes every problem, and answers with its start, or with one step of it along its first coordinate.
class Listener : public marrow::Optimizer {
 public:
  explicit Listener(bool goes = false) : goes_(goes) {}
  marrow::MinimisationResult minimise(const marrow::MinimisationProblem& problem) const override {
    problems.push_back(problem);
    marrow::MinimisationResult result;
    result.x = problem.start;
    if (goes_) result.x[0] += problem.initial_step[0];
    result.value = problem.function(result.x);
    result.evaluations = 7;
    if (problem.observer) problem.observer(1, result.x, result.value);
    return result;
  }
  mutable std::vector<marrow::MinimisationProblem> problems;  ///< their functions hold no longer than the search

 private:
  bool goes_;
};

}  // namespace well
