// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <tbb/parallel_for.h>

#include <array>
#include <marrow/domain/decompositions.hpp>

#include "marrow/toolbox/match/views_cost.hpp"

namespace marrow::refine {

/// From degrees and mm to radians and mm.
inline Vector6d from_units(const Vector6d& deg_and_mm) {
  Vector6d scaled = deg_and_mm;
  scaled.head<3>() *= radians(1);
  return scaled;
}

/// Quadratic model of a bone's cost in one view about the pose in which this view sees it, for motions in degrees and
/// mm; and the scatter of the gradient over the blocks of this view's image.
struct Model {
  double value = 0;
  Vector6d gradient = Vector6d::Zero();
  Matrix6d curvature = Matrix6d::Zero(), scatter = Matrix6d::Zero();
};

/// A bone's cost in one view. Refers to the cost and the frame, which must outlive it. It remembers the steps of its
/// last model, so model_at() is for one thread at a time.
class BoneInView {
 public:
  /// The views are those that the cost compares, in their order: their sizes give the blocks.
  BoneInView(const Cost& cost, const FragmentFrame& frame, std::size_t view, const List<View>& views)
      : cost_(cost), frame_(frame), view_(view), share_(1.0 / double(views.size())) {
    for (std::size_t i = 0; i < views.size(); ++i) {
      const auto count = std::size_t(match::Blocks::of(views[i].camera).count());
      (i < view ? before_ : i == view ? blocks_ : after_) += count;
    }
  }

  double value(const RigidTransform& pose) const { return cost_.value_in_view(view_, pose); }

  /// By the cost's derivatives in a view, if it has them; the scatter only if asked for. Otherwise by central
  /// differences: steps are chosen so long that the cost rises by about `wanted_rise`; 0: by the deviation of the
  /// cost's value from block to block.
  Model model_at(const RigidTransform& pose, double wanted_rise, bool with_scatter) {
    if (const auto exact = exact_model(pose, with_scatter)) return *exact;
    Model model;
    const Sample here = sample(pose, !(wanted_rise > 0));
    model.value = here.value;
    if (!(wanted_rise > 0)) wanted_rise = (here.without.array() - here.without.mean()).matrix().norm();
    std::array<Sample, 12> ends;
    Vector6d rises;
    tbb::parallel_for(0, 6, [&](int axis) {
      Sample &before = ends[std::size_t(2 * axis)], &after = ends[std::size_t(2 * axis + 1)];
      const auto rise = [&] {
        before = sample(moved_by(pose, -Vector6d::Unit(axis)), with_scatter);
        after = sample(moved_by(pose, Vector6d::Unit(axis)), with_scatter);
        return 0.5 * (before.value + after.value) - model.value;
      };
      for (rises[axis] = rise(); rises[axis] > 3 * wanted_rise && steps_[axis] > kLeastStep; rises[axis] = rise())
        steps_[axis] *= 0.5;
      for (; rises[axis] < wanted_rise && steps_[axis] < kMostStep; rises[axis] = rise()) steps_[axis] *= 2;
    });
    for (std::size_t axis = 0; axis < 6; ++axis)
      model.gradient[Eigen::Index(axis)] = 0.5 * (ends[2 * axis + 1].value - ends[2 * axis].value);
    model.curvature = curvature(pose, model.value, rises);
    if (with_scatter) model.scatter = scatter(ends);
    const Vector6d per_step = steps_.cwiseInverse();
    model.gradient = model.gradient.cwiseProduct(per_step);
    model.curvature = per_step.asDiagonal() * model.curvature * per_step.asDiagonal();
    model.scatter = per_step.asDiagonal() * model.scatter * per_step.asDiagonal();
    return model;
  }

  /// Moves a model, which already holds the value of the new pose. It keeps its scatter. Without derivatives it keeps
  /// its curvature, too, and has its gradient by the steps of the last model. This takes a quarter of the time.
  void move(Model& model, const RigidTransform& pose) const {
    if (const auto exact = exact_model(pose, false)) {
      model.gradient = exact->gradient;
      model.curvature = exact->curvature;
      return;
    }
    tbb::parallel_for(0, 6, [&](int axis) {
      model.gradient[axis] =
          (value(moved_by(pose, Vector6d::Unit(axis))) - value(moved_by(pose, -Vector6d::Unit(axis)))) /
          (2 * steps_[axis]);
    });
  }

 private:
  std::optional<Model> exact_model(const RigidTransform& pose, bool with_scatter) const {
    const auto* views = dynamic_cast<const match::ViewsCost*>(&cost_);
    const auto expansion = views ? views->expansion_in_view(view_, pose, frame_) : std::nullopt;
    if (!expansion) return std::nullopt;
    const Vector6d unit = from_units(Vector6d::Ones());
    Model model;
    model.value = expansion->whole.value;
    model.gradient = unit.cwiseProduct(expansion->whole.gradient);
    model.curvature = unit.asDiagonal() * expansion->whole.curvature * unit.asDiagonal();
    if (!with_scatter) return model;
    check_count(expansion->without_block.size(), blocks_);
    Vector6d mean = Vector6d::Zero();
    for (const Cost::Expansion& without : expansion->without_block) mean += without.gradient / double(blocks_);
    for (const Cost::Expansion& without : expansion->without_block) {
      const Vector6d change = unit.cwiseProduct(without.gradient - mean);
      model.scatter += change * change.transpose();
    }
    return model;
  }

  static constexpr double kMostStep = 4, kLeastStep = 1.0 / 64;  // degrees or mm

  RigidTransform moved_by(const RigidTransform& pose, const Vector6d& steps) const {
    return moved(pose, frame_, from_units(steps.cwiseProduct(steps_)));
  }
  /// In units of the steps, without its negative eigenvalues.
  Matrix6d curvature(const RigidTransform& pose, double middle, const Vector6d& rises) const {
    Matrix6d h = (2 * rises).asDiagonal();
    tbb::parallel_for(0, 15, [&](int k) {
      int i = 1, j = k;
      for (; j >= i; ++i) j -= i;
      const Vector6d both = Vector6d::Unit(i) + Vector6d::Unit(j);
      h(i, j) = h(j, i) =
          0.5 * (value(moved_by(pose, both)) + value(moved_by(pose, -both))) - middle - rises[i] - rises[j];
    });
    const SymmetricEigen<6> eigen = eigen_of_symmetric(h);
    return eigen.vectors * eigen.values.cwiseMax(0).asDiagonal() * eigen.vectors.transpose();
  }
  /// The cost in this view, and without each block of its image. The latter values may include a constant: the cost in
  /// the other views.
  struct Sample {
    double value = 0;
    Eigen::VectorXd without;
  };
  Sample sample(const RigidTransform& pose, bool with_blocks) const {
    if (!with_blocks) return {value(pose), {}};
    // A cost that is a mean over views gives both at once. Others compare all views a second time.
    if (const auto* views = dynamic_cast<const match::ViewsCost*>(&cost_)) {
      const match::ViewsCost::Split split = views->split(view_, pose);
      check_count(split.without_block.size(), blocks_);
      return {split.value, Eigen::VectorXd::Map(split.without_block.data(), Eigen::Index(blocks_))};
    }
    const std::vector<double> without = cost_.without_each_block(pose);
    check_count(without.size(), before_ + blocks_ + after_);
    return {value(pose), Eigen::VectorXd::Map(without.data() + before_, Eigen::Index(blocks_)) / share_};
  }
  static void check_count(std::size_t blocks, std::size_t expected) {
    if (blocks != expected)
      throw Error(
          "the cost gives no values without each block of the images; use a cost that predicts deviations, such as "
          "that of the contour");
  }
  /// The scatter of the slopes about their mean. The mean is the slope of the whole cost in this view, plus what the
  /// other views add.
  Matrix6d scatter(const std::array<Sample, 12>& ends) const {
    Eigen::MatrixXd gradients(6, Eigen::Index(blocks_));
    for (std::size_t axis = 0; axis < 6; ++axis) {
      const Eigen::VectorXd slopes = 0.5 * (ends[2 * axis + 1].without - ends[2 * axis].without);
      gradients.row(Eigen::Index(axis)) = (slopes.array() - slopes.mean()).transpose();
    }
    return gradients * gradients.transpose();
  }

  const Cost& cost_;
  const FragmentFrame& frame_;
  const std::size_t view_;
  const double share_;  ///< of the view in the cost
  std::size_t before_ = 0, blocks_ = 0, after_ = 0;
  Vector6d steps_ = Vector6d::Constant(0.25);
};

}  // namespace marrow::refine
