// SPDX-License-Identifier: Apache-2.0
// A cost of the images together with what is known about the pose from elsewhere, such as markers on the skin. The
// prior is Student's t. Near its middle it counts like a normal distribution with the prior's covariance. If the images
// clearly show a pose far away, it hardly holds the pose back.
#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <marrow/plugin.hpp>

#include "cost_noise.hpp"
#include "marrow/toolbox/geometry/rigid_fit.hpp"
#include "marrow/toolbox/match/bones_together.hpp"

namespace {

using namespace marrow;

struct Options {
  double degrees_of_freedom = 30;
  double noise_times = 2;
};

/// How a rotation vector r changes if a small rotation comes before it: the inverse of the right Jacobian of SO(3)
/// (Sola, Deray and Atchuthan, arXiv 1812.01537, Eq 144).
Eigen::Matrix3d vector_by_rotation(const Eigen::Vector3d& r) {
  const double angle = r.norm();
  const Eigen::Matrix3d cross = cross_matrix(r);
  const double second =
      angle < 1e-4 ? 1.0 / 12 : (1 - 0.5 * angle * std::cos(0.5 * angle) / std::sin(0.5 * angle)) / (angle * angle);
  return Eigen::Matrix3d::Identity() + 0.5 * cross + second * cross * cross;
}

/// Minus the logarithm of the density of a pose, without a constant.
class Prior {
 public:
  Prior(const Pose& pose, double degrees_of_freedom)
      : pose_(pose), weight_(degrees_of_freedom + 6), information_(inverse_of_symmetric(*pose.covariance)) {
    const auto eigen = eigen_of_symmetric<6>(information_);
    root_ = eigen.vectors * eigen.values.cwiseSqrt().asDiagonal();
  }

  Vector6d motion(const RigidTransform& pose) const {
    return motion_between(pose_.world_from_model, pose, pose_.frame);
  }

  /// With q = xi^T Lambda xi: (nu + 6) / 2 log(1 + q / (nu + 6)), the multivariate t with nu degrees of freedom whose
  /// curvature in the middle is Lambda.
  double energy(const RigidTransform& pose) const { return 0.5 * weight_ * std::log1p(square(motion(pose)) / weight_); }

  /// The weight of a motion, relative to its weight in a normal distribution: 1 in the middle, less outside.
  double weight(const Vector6d& motion) const { return weight_ / (weight_ + square(motion)); }

  /// How motion() changes with a small motion of the pose in `frame`.
  Matrix6d motion_by_motion(const Vector6d& motion, const FragmentFrame& frame) const {
    const Eigen::Matrix3d axes = pose_.frame.axes.transpose();
    Matrix6d in_own_frame = Matrix6d::Zero(), change = Matrix6d::Zero();
    in_own_frame.topLeftCorner<3, 3>() = axes * frame.axes;
    in_own_frame.bottomRows<3>() = axes * geometry::point_by_motion(frame, pose_.frame.origin_mm);
    change.topLeftCorner<3, 3>() = vector_by_rotation(motion.head<3>());
    change.bottomRightCorner<3, 3>() = rotation_from_vector(motion.head<3>());
    return change * in_own_frame;
  }

  const Matrix6d& information() const { return information_; }
  /// A matrix L with L L^T = the information.
  const Matrix6d& root() const { return root_; }

 private:
  double square(const Vector6d& motion) const { return motion.dot(information_ * motion); }

  Pose pose_;
  double weight_;
  Matrix6d information_, root_;
};

/// The prior counts the same at each level of the cost. A coarse level is too rough to estimate its own noise.
class WithPrior : public Cost, public match::CostAmongOthers {
 public:
  /// `noise`: the weight of a unit of the prior. `noise_times`: how many times larger the images' noise is than their
  /// blocks show. `owner`, or the runtime, keeps `images`.
  WithPrior(std::shared_ptr<const Prior> prior, double noise, double noise_times, const Cost& images,
            std::shared_ptr<const Cost> owner)
      : prior_(std::move(prior)), noise_(noise), noise_times_(noise_times), images_(images), owner_(std::move(owner)) {}

  double value(const RigidTransform& pose) const override { return images_.value(pose) + term(pose); }
  std::vector<double> values(const std::vector<RigidTransform>& poses) const override {
    std::vector<double> values = images_.values(poses);
    for (std::size_t i = 0; i < poses.size(); ++i) values[i] += term(poses[i]);
    return values;
  }
  std::shared_ptr<const Cost> at_level(const CostLevel& level) const override {
    const std::shared_ptr<const Cost> images = images_.at_level(level);
    return std::make_shared<WithPrior>(prior_, noise_, noise_times_, *images, images);
  }

  std::shared_ptr<const Cost> with_others(const List<RigidTransform>& world_from_others) const override {
    const std::shared_ptr<const Cost> images = match::among_others(images_, world_from_others);
    return images ? std::make_shared<WithPrior>(prior_, noise_, noise_times_, *images, images) : nullptr;
  }

  std::optional<Expansion> expansion(const RigidTransform& pose, const FragmentFrame& frame) const override {
    auto about = images_.expansion(pose, frame);
    if (!about) return about;
    const Expansion prior = term_about(pose, frame);
    about->value += prior.value;
    about->gradient += prior.gradient;
    about->curvature += prior.curvature;
    return about;
  }

  /// What the images alone say: the prior says something about every pose.
  std::string nothing_compared(const RigidTransform& pose) const override { return images_.nothing_compared(pose); }
  std::vector<std::string> silent_views(const RigidTransform& pose) const override {
    return images_.silent_views(pose);
  }

  /// The blocks of the images, and six residuals of the prior, each with its expected size. So the deviation that is
  /// predicted from them is that of images and prior together. The change by each block is enlarged, because the noise
  /// of the images is larger than the blocks show.
  std::vector<double> without_each_block(const RigidTransform& pose) const override {
    std::vector<double> without = images_.without_each_block(pose);
    if (without.empty()) return without;
    const double images = images_.value(pose), whole = images + term(pose);
    for (double& value : without) value = whole + std::sqrt(noise_times_) * (value - images);
    const Vector6d motion = prior_->motion(pose);
    const Vector6d residuals = std::sqrt(prior_->weight(motion)) * prior_->root().transpose() * motion;
    for (const double residual : residuals) without.push_back(whole + noise_ * residual);
    return without;
  }
  std::vector<Expansion> expansion_without_each_block(const RigidTransform& pose,
                                                      const FragmentFrame& frame) const override {
    std::vector<Expansion> without = images_.expansion_without_each_block(pose, frame);
    const auto images = images_.expansion(pose, frame), whole = expansion(pose, frame);
    if (without.empty() || !images || !whole) return {};
    const Expansion prior = term_about(pose, frame);
    Matrix6d mean = Matrix6d::Zero();
    const double count = double(without.size());
    for (Expansion& one : without) {
      one.value += prior.value;
      one.gradient = whole->gradient + std::sqrt(noise_times_) * (one.gradient - images->gradient);
      one.curvature += prior.curvature;
      mean += one.curvature / count;
    }
    const Vector6d motion = prior_->motion(pose);
    const Matrix6d residuals =
        std::sqrt(prior_->weight(motion)) * prior_->motion_by_motion(motion, frame).transpose() * prior_->root();
    for (int i = 0; i < 6; ++i) without.push_back({whole->value, whole->gradient + noise_ * residuals.col(i), mean});
    return without;
  }

 private:
  double term(const RigidTransform& pose) const { return noise_ * prior_->energy(pose); }

  /// Gauss-Newton with the weight of Student's t.
  Expansion term_about(const RigidTransform& pose, const FragmentFrame& frame) const {
    const Vector6d motion = prior_->motion(pose);
    const Matrix6d change = prior_->motion_by_motion(motion, frame),
                   pulls = noise_ * prior_->weight(motion) * change.transpose() * prior_->information();
    return {term(pose), pulls * motion, pulls * change};
  }

  std::shared_ptr<const Prior> prior_;
  double noise_, noise_times_;
  const Cost& images_;
  std::shared_ptr<const Cost> owner_;
};

std::shared_ptr<const Cost> with_prior(const Cost& cost, const Pose& prior, const Pose& found, const Options& options) {
  similarity::check_known(prior, "the prior", "take it from a node that predicts one, such as a fit of markers");
  similarity::check_found(found);
  if (prior.world_from_model.source != found.world_from_model.source ||
      prior.world_from_model.target != found.world_from_model.target)
    throw Error("the prior leads from '" + prior.world_from_model.source + "' to '" + prior.world_from_model.target +
                "', but the pose found by the images from '" + found.world_from_model.source + "' to '" +
                found.world_from_model.target + "'; give poses of the same model");
  return std::make_shared<WithPrior>(std::make_shared<const Prior>(prior, options.degrees_of_freedom),
                                     options.noise_times * similarity::noise_of(cost, found), options.noise_times, cost,
                                     nullptr);
}

}  // namespace

MARROW_PLUGIN(plugin) {
  plugin.node("similarity.with_prior", with_prior)
      .summary(
          "A cost together with a pose that is known from elsewhere, as Student's t with this pose's covariance; for "
          "markers on the skin")
      .in("cost", "cost of the images alone")
      .in("prior", "pose known from elsewhere, with its covariance")
      .in("found",
          "pose found by the same cost alone, with its covariance: how much the cost rises there within a standard "
          "deviation says what the prior counts")
      .trait("derivatives")
      .out("cost", "the cost, plus minus the logarithm of the prior's density in units of the cost's likelihood")
      .option("degrees_of_freedom", &Options::degrees_of_freedom,
              "of Student's t; with fewer, a pose far from the prior costs less", marrow::at_least(1),
              marrow::at_most(1000))
      .option("noise_times", &Options::noise_times,
              "how many times larger the noise of the images' cost is than the deviations of the pose found say: these "
              "come from blocks of the images, and do not see an error that is common to several blocks",
              marrow::at_least(0.01), marrow::at_most(1000));
}
