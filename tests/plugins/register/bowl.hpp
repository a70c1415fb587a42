// SPDX-License-Identifier: Apache-2.0
#pragma once
// A cost with exactly known Hessian, derivatives and noise, and an optimizer that only records its problems.
#include <marrow/domain/decompositions.hpp>

#include "well.hpp"

namespace marrow::test::well {

/// way . hessian way / 2, of the way from the bottom in degrees and mm about the frame.
class Bowl : public Cost {
 public:
  Bowl(RigidTransform bottom, FragmentFrame frame, const Matrix6d& hessian, double information = 1)
      : bottom_(std::move(bottom)), frame_(std::move(frame)), hessian_(hessian) {
    const SymmetricEigen<6> eigen = eigen_of_symmetric(hessian);
    for (int i = 0; i < 6; ++i)
      slopes_.push_back(std::sqrt(0.5 * std::max(eigen.values[i], 0.0) / information) * eigen.vectors.col(i));
  }

  /// About well::truth().
  explicit Bowl(const Matrix6d& hessian = Matrix6d::Identity(), double information = 1)
      : Bowl(kTruth, kFrame, hessian, information) {}

  double value(const RigidTransform& pose) const override {
    const Vector6d motion = way(bottom_, pose, frame_);
    return 0.5 * motion.dot(hessian_ * motion);
  }
  std::shared_ptr<const Cost> at_level(const CostLevel& level) const override {
    levels.push_back(level);
    return std::make_shared<Bowl>(*this);
  }
  /// Twelve blocks. Without each of them the bowl is higher, and tilted to one side along one of its eigenvectors, so
  /// much that its covariance is the inverse of information * hessian. All of them together do not tilt it.
  Numbers without_each_block(const RigidTransform& pose) const override {
    const Vector6d motion = way(bottom_, pose, frame_);
    Numbers values;
    for (const Vector6d& slope : slopes_)
      for (const double side : {-1, 1}) values.push_back(value(pose) + 0.1 + side * slope.dot(motion));
    return values;
  }

  mutable std::vector<CostLevel> levels;

 private:
  RigidTransform bottom_;
  FragmentFrame frame_;
  Matrix6d hessian_;
  std::vector<Vector6d> slopes_;
};

/// A bowl whose value, or whose values without each block, are made from the bowl's by a formula.
class Altered : public Bowl {
 public:
  template <class T>
  using Formula = std::function<T(const Bowl&, const RigidTransform&)>;
  Altered(const Bowl& bowl, Formula<double> value, Formula<Numbers> without_each_block = nullptr)
      : Bowl(bowl), value_(std::move(value)), without_(std::move(without_each_block)) {}
  double value(const RigidTransform& pose) const override { return value_ ? value_(*this, pose) : Bowl::value(pose); }
  Numbers without_each_block(const RigidTransform& pose) const override {
    return without_ ? without_(*this, pose) : Bowl::without_each_block(pose);
  }

 private:
  Formula<double> value_;
  Formula<Numbers> without_;
};

/// Notes every problem, and answers with its start, or with one step of it along its first coordinate.
class Listener : public Optimizer {
 public:
  explicit Listener(bool goes = false) : goes_(goes) {}
  MinimisationResult minimise(const MinimisationProblem& problem) const override {
    problems.push_back(problem);
    MinimisationResult result;
    result.x = problem.start;
    if (goes_) result.x[0] += problem.initial_step[0];
    result.value = problem.function(result.x);
    result.evaluations = 7;
    if (problem.observer) problem.observer(1, result.x, result.value);
    return result;
  }
  mutable std::vector<MinimisationProblem> problems;  ///< their functions hold no longer than the search

 private:
  bool goes_;
};

}  // namespace marrow::test::well

namespace well = marrow::test::well;
