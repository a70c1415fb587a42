// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <marrow/domain/decompositions.hpp>

#include "shipped.hpp"
#include "tests/plugins/register/bowl.hpp"

namespace with_prior_test {

using marrow::Cost, marrow::Matrix6d, marrow::Pose, marrow::Vector6d;
using well::pose_at;

/// A bowl with two blocks and with derivatives, computed by central differences. Both are exact for small motions.
class Differentiable : public well::Bowl {
 public:
  using Bowl::Bowl;
  std::optional<Expansion> expansion(const marrow::RigidTransform& pose,
                                     const marrow::FragmentFrame& frame) const override {
    return of(*this, pose, frame);
  }
  std::vector<Expansion> expansion_without_each_block(const marrow::RigidTransform& pose,
                                                      const marrow::FragmentFrame& frame) const override {
    return {of(*this, pose, frame), of(*this, pose, frame)};
  }
  /// The expansion of any cost, by differences of its values.
  static Expansion of(const Cost& cost, const marrow::RigidTransform& pose, const marrow::FragmentFrame& frame) {
    constexpr double kStep = 1e-4;
    const auto at = [&](const Vector6d& motion) { return cost.value(marrow::moved(pose, frame, motion)); };
    Expansion about;
    about.value = cost.value(pose);
    for (int i = 0; i < 6; ++i) {
      const Vector6d a = kStep * Vector6d::Unit(i);
      about.gradient[i] = (at(a) - at(-a)) / (2 * kStep);
      for (int j = 0; j < 6; ++j) {
        const Vector6d b = kStep * Vector6d::Unit(j);
        about.curvature(i, j) = (at(a + b) - at(a - b) - at(b - a) + at(-a - b)) / (4 * kStep * kStep);
      }
    }
    return about;
  }
};

Pose truth() {
  Pose pose;
  pose.frame = {Eigen::Vector3d(5, -3, 80), marrow::rotation_from_vector({0.1, -0.2, 0.3})};
  pose.world_from_model = {"world", "ct", marrow::rotation_from_vector({0.2, 0.1, -0.4}), Eigen::Vector3d(12, -7, 30)};
  return pose;
}

/// From degrees and mm to radians and mm.
Matrix6d in_radians(const Matrix6d& deg_and_mm) {
  Vector6d unit = Vector6d::Ones();
  unit.head<3>() *= marrow::radians(1);
  return unit.asDiagonal() * deg_and_mm * unit.asDiagonal();
}
Pose with_deviations(Pose pose, const Vector6d& deg_and_mm) {
  pose.covariance = in_radians(Matrix6d(deg_and_mm.cwiseAbs2().asDiagonal()));
  return pose;
}
Vector6d six(double rotations_deg, double axial_deg, double shifts_mm) {
  Vector6d values;
  values << rotations_deg, rotations_deg, axial_deg, shifts_mm, shifts_mm, shifts_mm;
  return values;
}

constexpr double kInformation = 1e4;

/// A bowl whose curvature is 1 per square degree and mm. Its minimum is known to 0.01 degrees and mm. So the noise of
/// its value is 1e-4, and a unit of the prior counts twice this.
struct Trial {
  explicit Trial(const Pose& prior) {
    const Pose at = truth();
    images = std::make_shared<Differentiable>(at.world_from_model, at.frame, Matrix6d::Identity(), kInformation);
    inputs["cost"] = marrow::Value::of<Cost>(images);
    inputs["prior"] = shipped::item(prior);
    inputs["found"] = shipped::item(with_deviations(at, six(0.01, 0.01, 0.01)));
  }
  std::shared_ptr<const Cost> cost(double degrees_of_freedom = 4) {
    made = shipped::call("similarity.with_prior", inputs, {{"degrees_of_freedom", degrees_of_freedom}}).at("cost");
    return std::static_pointer_cast<const Cost>(made.data);
  }
  std::string refusal() const { return shipped::refusal("similarity.with_prior", inputs); }
  std::shared_ptr<const Differentiable> images;
  shipped::Inputs inputs;
  marrow::Value made;
};

constexpr double kUnit = 2 / kInformation;

TEST(WithPrior, AddsMinusTheLogarithmOfStudentsT) {
  const Pose prior = with_deviations(truth(), six(1, 5, 3));
  Trial trial(prior);
  const auto cost = trial.cost();
  EXPECT_NEAR(cost->value(truth().world_from_model), 0, 1e-12);
  // 10 degrees about the long axis are two deviations: q = 4; (4 + 6) / 2 log(1 + 4 / 10) = 1.68236.
  const auto turned = pose_at(truth(), 0, 0, 10, 0, 0, 0).world_from_model;
  EXPECT_NEAR(cost->value(turned) - trial.images->value(turned), 1.68236 * kUnit, 1e-5 * kUnit);
  // One deviation along each of two axes: q = 2; 5 log(1.2) = 0.911608.
  const auto moved = pose_at(truth(), 0, 0, 0, 3, -3, 0).world_from_model;
  EXPECT_NEAR(cost->value(moved) - trial.images->value(moved), 0.911608 * kUnit, 1e-5 * kUnit);
  // With many degrees of freedom nearly q / 2.
  EXPECT_NEAR(trial.cost(1000)->value(turned) - trial.images->value(turned), 2 * kUnit, 0.01 * kUnit);
  const std::vector<double> both = trial.cost()->values({turned, moved});
  EXPECT_EQ(both, (std::vector<double>{trial.cost()->value(turned), trial.cost()->value(moved)}));
}

TEST(WithPrior, CountsTheSameAtEachLevelOfTheCost) {
  Trial trial(with_deviations(truth(), six(1, 5, 3)));
  const auto turned = pose_at(truth(), 0, 0, 10, 0, 0, 0).world_from_model;
  const auto level = trial.cost()->at_level({3, 12, 4});
  EXPECT_NEAR(level->value(turned) - trial.images->value(turned), 1.68236 * kUnit, 1e-5 * kUnit);
  ASSERT_EQ(trial.images->levels.size(), 1u);
  EXPECT_EQ(trial.images->levels[0].contour_spacing_px, 3);
}

TEST(WithPrior, ItsDerivativesAreThoseOfItsValues) {
  Pose prior = with_deviations(pose_at(truth(), 8, -5, 30, 4, -6, 9), six(2, 5, 3));
  prior.frame = {Eigen::Vector3d(-20, 30, 60), marrow::rotation_from_vector({-0.3, 0.1, 1.1})};  // not the bone's
  Trial trial(prior);
  const auto cost = trial.cost();
  const marrow::FragmentFrame frame = truth().frame;
  for (const Pose& at : {truth(), pose_at(truth(), -3, 12, -40, 7, 0, 5)}) {
    const auto about = cost->expansion(at.world_from_model, frame);
    ASSERT_TRUE(about);
    EXPECT_NEAR(about->value, cost->value(at.world_from_model), 1e-12);
    const Cost::Expansion differences = Differentiable::of(*cost, at.world_from_model, frame);
    const Cost::Expansion images = Differentiable::of(*trial.images, at.world_from_model, frame);
    const Vector6d by_prior = differences.gradient - images.gradient;
    EXPECT_LT((about->gradient - differences.gradient).norm(), 1e-5 * by_prior.norm());
    EXPECT_GT(by_prior.norm(), 1e-4);
    EXPECT_GE(marrow::eigen_of_symmetric<6>(Matrix6d(about->curvature - images.curvature)).values[0], -1e-9);
  }
}

TEST(WithPrior, InTheMiddleItsCurvatureIsTheInverseOfTheCovariance) {
  const Pose prior = with_deviations(truth(), six(2, 5, 3));
  Trial trial(prior);
  const auto about = trial.cost()->expansion(truth().world_from_model, truth().frame);
  const auto images = trial.images->expansion(truth().world_from_model, truth().frame);
  const Matrix6d expected = kUnit * prior.covariance->inverse();
  EXPECT_LT((about->curvature - images->curvature - expected).norm(), 1e-3 * expected.norm());
}

TEST(WithPrior, ItsSixResidualsStandForItsCovariance) {
  // Without one of them the gradient changes by unit * a column of L, and L L^T is the inverse of the covariance.
  const Pose prior = with_deviations(truth(), six(2, 5, 3));
  Trial trial(prior);
  const auto cost = trial.cost();
  const auto without = cost->expansion_without_each_block(truth().world_from_model, truth().frame);
  ASSERT_EQ(without.size(), 2u + 6);
  const Vector6d whole = cost->expansion(truth().world_from_model, truth().frame)->gradient;
  Matrix6d sum = Matrix6d::Zero();
  for (std::size_t i = 2; i < without.size(); ++i)
    sum += (without[i].gradient - whole) * (without[i].gradient - whole).transpose();
  const Matrix6d expected = kUnit * kUnit * prior.covariance->inverse();
  EXPECT_LT((sum - expected).norm(), 1e-6 * expected.norm());
  // The same by values, for a motion of one deviation about the long axis.
  const auto turned = pose_at(truth(), 0, 0, 5, 0, 0, 0).world_from_model;
  const std::vector<double> values = cost->without_each_block(turned);
  ASSERT_EQ(values.size(), 12u + 6);
  double squares = 0;
  for (std::size_t i = 12; i < values.size(); ++i) squares += std::pow(values[i] - cost->value(turned), 2);
  EXPECT_NEAR(squares / (kUnit * kUnit), 10.0 / 11, 1e-6) << "q = 1, and the weight of Student's t is 10 / 11";
}

/// Without one of its two blocks it is tilted to one side, without the other to the other side.
class Tilted : public Differentiable {
 public:
  using Differentiable::Differentiable;
  std::vector<Expansion> expansion_without_each_block(const marrow::RigidTransform& pose,
                                                      const marrow::FragmentFrame& frame) const override {
    std::vector<Expansion> without = Differentiable::expansion_without_each_block(pose, frame);
    without[0].gradient += Vector6d::Constant(0.1);
    without[1].gradient -= Vector6d::Constant(0.1);
    return without;
  }
};

// If the noise is four times as large as the blocks show, each block shows half the deviation.
TEST(WithPrior, WhatABlockChangesGrowsWithTheNoise) {
  Trial trial(with_deviations(truth(), six(2, 5, 3)));
  trial.images = std::make_shared<Tilted>(truth().world_from_model, truth().frame, Matrix6d::Identity(), kInformation);
  trial.inputs["cost"] = marrow::Value::of<Cost>(trial.images);
  const auto turned = pose_at(truth(), 0, 0, 5, 0, 0, 0).world_from_model;
  const auto cost_with = [&](double times) {
    trial.made = shipped::call("similarity.with_prior", trial.inputs, {{"noise_times", times}}).at("cost");
    return std::static_pointer_cast<const Cost>(trial.made.data);
  };
  const std::vector<double> of_images = trial.images->without_each_block(turned);
  for (const double times : {1.0, 4.0}) {
    const auto cost = cost_with(times);
    const std::vector<double> values = cost->without_each_block(turned);
    for (std::size_t i = 0; i < of_images.size(); ++i)
      EXPECT_NEAR(values[i] - cost->value(turned), std::sqrt(times) * (of_images[i] - trial.images->value(turned)),
                  1e-12);
    const Vector6d whole = cost->expansion(turned, truth().frame)->gradient;
    const auto without = cost->expansion_without_each_block(turned, truth().frame);
    for (int axis = 0; axis < 6; ++axis) {
      EXPECT_NEAR(without[0].gradient[axis] - whole[axis], 0.1 * std::sqrt(times), 1e-12);
      EXPECT_NEAR(without[1].gradient[axis] - whole[axis], -0.1 * std::sqrt(times), 1e-12);
    }
  }
}

/// Gives its derivatives, but not those without each block.
class Whole : public Differentiable {
 public:
  using Differentiable::Differentiable;
  std::vector<Expansion> expansion_without_each_block(const marrow::RigidTransform&,
                                                      const marrow::FragmentFrame&) const override {
    return {};
  }
};

TEST(WithPrior, ResidualsAloneAreNoDivisionIntoBlocks) {
  Trial trial(with_deviations(truth(), six(2, 5, 3)));
  trial.inputs["cost"] = marrow::Value::of<Cost>(
      std::make_shared<Whole>(truth().world_from_model, truth().frame, Matrix6d::Identity(), kInformation));
  const auto cost = trial.cost();
  ASSERT_TRUE(cost->expansion(truth().world_from_model, truth().frame));
  EXPECT_EQ(cost->expansion_without_each_block(truth().world_from_model, truth().frame).size(), 0u);
}

TEST(WithPrior, CannotBeSplitIntoViews) {
  EXPECT_EQ(Trial(with_deviations(truth(), six(1, 5, 3))).cost()->view_count(), 0u);
}

TEST(WithPrior, SaysWhatIsWrong) {
  EXPECT_EQ(Trial(truth()).refusal(),
            "the prior has no covariance; take it from a node that predicts one, such as a fit of markers");
  EXPECT_EQ(
      Trial(with_deviations(truth(), six(1, 0, 3))).refusal(),
      "the prior has a covariance that is not positive definite; take it from a node that predicts one, such as a "
      "fit of markers");
  EXPECT_EQ(
      Trial(with_deviations(truth(), six(1, std::nan(""), 3))).refusal(),
      "the prior has a covariance that is not positive definite; take it from a node that predicts one, such as a "
      "fit of markers");
  Trial trial(with_deviations(truth(), six(1, 5, 3)));
  trial.inputs["found"] = shipped::item(truth());
  EXPECT_EQ(trial.refusal(),
            "the pose found by the images has no covariance; take it from a registration by a cost of the kind "
            "similarity, which predicts one");
  Pose other = with_deviations(truth(), six(1, 5, 3));
  other.world_from_model.source = "bone";
  EXPECT_EQ(Trial(other).refusal(),
            "the prior leads from 'bone' to 'world', but the pose found by the images from 'ct' to 'world'; give poses "
            "of the same model");
}

/// A bowl whose images show nothing.
class Mute : public Differentiable {
 public:
  using Differentiable::Differentiable;
  std::string nothing_compared(const marrow::RigidTransform&) const override { return "view 'a': it is black"; }
  std::vector<std::string> silent_views(const marrow::RigidTransform&) const override {
    return {"view 'a': it is black"};
  }
};

TEST(WithPrior, APriorIsNoImage) {
  Trial trial(with_deviations(truth(), six(1, 5, 3)));
  trial.inputs["cost"] = marrow::Value::of<Cost>(
      std::make_shared<Mute>(truth().world_from_model, truth().frame, Matrix6d::Identity(), kInformation));
  const auto cost = trial.cost();
  EXPECT_EQ(cost->nothing_compared(truth().world_from_model), "view 'a': it is black");
  EXPECT_EQ(cost->silent_views(truth().world_from_model), std::vector<std::string>{"view 'a': it is black"});
}

}  // namespace with_prior_test
