// SPDX-License-Identifier: Apache-2.0
#pragma once
// Cameras by the bones that their images show. A view whose camera is off by a motion sees each bone in a pose that is
// off by the same motion, for all bones. So no image has to be projected again: a cost that can be split into views
// tells which pose each view alone prefers. The unknowns are the poses of the bones and one motion for each view. They
// minimise the sum of the costs, in units of their noise, and of the squares of the motions, in units of the deviations
// expected of a calibration (a Gaussian prior, CameraPrior). Levenberg-Marquardt steps find the minimum. The
// curvature there gives the covariance of all poses and motions together (Laplace's approximation).
#include <tbb/parallel_for.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "coarse_search.hpp"

namespace marrow::refine {

/// See the help texts in cameras.cpp.
struct Options : ExpectedErrors {
  double contour_spacing_px = 2;
  double reach_px = 6;
  std::vector<double> pixel_step{2};
  int max_iterations = 15;
  std::string reference_view;
};

/// The unknowns: a pose for each bone, and a motion in degrees and mm for each view.
struct State {
  std::vector<RigidTransform> poses;
  std::vector<Vector6d> motions;
};

class Refinement {
 public:
  /// What is stated about the cameras may be absent, as a list or in it.
  Refinement(const List<Cost>& costs, const List<Pose>& poses, const List<View>& views, const Options& options,
             const List<geometry::CameraDeviations>* stated)
      : costs_(costs), poses_(poses), views_(views), options_(options) {
    Eigen::Vector3d centre = Eigen::Vector3d::Zero();
    for (const Pose& pose : poses) centre += pose.world_from_model * pose.frame.origin_mm / double(poses.size());
    for (std::size_t v = 0; v < views.size(); ++v) {
      sights_.push_back(sight_of(views[v], centre, options, stated ? (*stated)[v] : geometry::CameraDeviations()));
      if (views.name(v) == options.reference_view) sights_.back().count_as_right();
    }
    prior_.emplace(sights_);
    for (const Pose& pose : poses) state_.poses.push_back(pose.world_from_model);
    state_.motions.assign(views.size(), Vector6d::Zero());
    compare_each(options_.pixel_step.front());
  }

  /// If a camera may be off by more than an outline's reach, looks for the bones in each view first, by these costs.
  void search(const List<Cost>& coarse_costs, Context& context) {
    if (!may_be_farther_off(views_, sights_, options_.reach_px)) return;
    given_ = state_;
    for (std::size_t v = 0; v < views_.size(); ++v)
      state_.motions[v] =
          CoarseSearch(coarse_costs, poses_, views_, v, sights_[v]).best_motion(options_.reach_px, context);
    give_shared_motion_to_bones();
    compare_at(coarse_costs, {options_.contour_spacing_px, options_.reach_px, int(options_.pixel_step.front())});
    std::vector<Model> first;
    descend(true, context, first);
    compare_each(options_.pixel_step.front());
  }

  /// What all cameras are off by together is more probably a motion of the bones. No image changes by this.
  void give_shared_motion_to_bones() {
    for (int round = 0; round < 3; ++round) {
      const RigidTransform shared = sights_[0].shared_motion(prior_->shared_motion(all_motions(state_)));
      for (RigidTransform& pose : state_.poses) pose = shared * pose;
      for (std::size_t v = 0; v < views_.size(); ++v)
        state_.motions[v] = sights_[v].numbers(sights_[v].motion(state_.motions[v]) * inverse(shared));
    }
  }

  /// Chooses the scale with the first pixel step, and goes on with the others, as from an approximate state.
  void run(Context& context) {
    choose_scale(context);
    for (std::size_t i = 1; i < options_.pixel_step.size(); ++i) {
      compare_each(options_.pixel_step[i]);
      std::vector<Model> first;
      converged_ = descend(true, context, first);
      expand(true);
    }
    const Eigen::MatrixXd here = std::sqrt(weight_) * root_of_inverse(equations().first);
    root_.resize(here.rows(), here.cols() + root_of_other_scales_.cols());
    root_ << here, root_of_other_scales_;
  }

  bool converged() const { return converged_; }
  /// How far the cameras are off relative to each other, in units of what the options expect.
  double scale() const { return scale_; }
  const State& state() const { return state_; }
  /// The cost of a bone at the level of the last pixel step; before run(), of the first one.
  const Cost& level(std::size_t bone) const { return *levels_[bone]; }
  const Sight& sight(std::size_t view) const { return sights_[view]; }
  /// The cost of a bone, as the mean over the views with their cameras corrected.
  double cost(std::size_t bone) const {
    double sum = 0;
    for (std::size_t v = 0; v < views_.size(); ++v)
      sum += models_[bone * views_.size() + v].value / double(views_.size());
    return sum;
  }
  Matrix6d covariance_of_pose(std::size_t bone) const {
    const Eigen::MatrixXd root = root_.middleRows<6>(at_pose(bone));
    return root * root.transpose();
  }
  /// Of the bone's small motion relative to the first bone: errors that both share do not count.
  Matrix6d covariance_beside_first(std::size_t bone) const {
    if (bone == 0) return Matrix6d::Zero();
    const auto frame_of = [&](std::size_t f) -> FragmentFrame {
      return {state_.poses[f] * poses_[f].frame.origin_mm, state_.poses[f].rotation * poses_[f].frame.axes};
    };
    Matrix6d change = change_of_frame(frame_of(0), frame_of(bone));  // the first bone's motion, as one of this bone
    change.bottomLeftCorner<3, 3>() *= radians(1);                   // rotations are in degrees here
    const Eigen::MatrixXd root = root_.middleRows<6>(at_pose(bone)) - change * root_.middleRows<6>(at_pose(0));
    return root * root.transpose();
  }
  Matrix6d covariance_of_motion(std::size_t view) const {
    const Eigen::MatrixXd root = root_.middleRows<6>(at_motion(view));
    return root * root.transpose();
  }

 private:
  /// How far a model's outline may be off the image's edges on both sides of a bone, which no scatter of blocks tells.
  static constexpr double kOutline_px = 0.2;

  /// The most probable state for a scale.
  struct Found {
    double scale = 1;
    bool converged = false;
    double evidence = 0;
    State state;
    std::vector<Model> models;
    Eigen::MatrixXd root;  ///< of the covariance
  };

  /// Compares every n-th pixel from now on.
  void compare_each(double pixel_step) {
    compare_at(costs_, {options_.contour_spacing_px, options_.reach_px, int(pixel_step)});
  }
  void compare_at(const List<Cost>& costs, const CostLevel& level) {
    in_views_.clear();
    levels_.clear();
    for (std::size_t f = 0; f < poses_.size(); ++f) {
      levels_.push_back(costs[f].at_level(level));
      for (std::size_t v = 0; v < views_.size(); ++v) in_views_.emplace_back(*levels_[f], poses_[f].frame, v, views_);
    }
    noise_.assign(poses_.size(), 0.0);
    models_.assign(in_views_.size(), Model());
  }

  /// Finds the most probable state if the cameras are off relative to each other as expected, by a tenth and by a
  /// hundredth of it, and keeps the state with the largest marginal likelihood. So cameras that are right stay as they
  /// are. The other states count in the covariance by their likelihood, because the images may hardly tell how far the
  /// cameras are off. After a search, the first state is that which it found, and the others begin at the given one.
  void choose_scale(Context& context) {
    expand(true);
    doubt_depth_of_reference();
    const State given = given_.value_or(state_);
    std::vector<Found> all;
    std::vector<Model> at_given = models_;
    for (const double scale : {1.0, 0.1, 0.01}) {
      scale_ = scale;
      if (scale < 1) state_ = given;
      if (!at_given.empty()) models_ = at_given;
      const bool converged = descend(scale == 1, context, at_given);
      if (scale == 1 && given_) at_given.clear();
      expand(scale == 1);
      all.push_back({scale, converged, evidence(), state_, models_, root_of_inverse(equations().first)});
      const std::string text =
          formatted("cameras off relative to each other by {:g} times what is expected: log evidence {:.4g}", scale,
                    all.back().evidence);
      context.debug(text);
    }
    const auto by_evidence = [](const Found& a, const Found& b) { return a.evidence < b.evidence; };
    const Found& best = *std::max_element(all.begin(), all.end(), by_evidence);
    scale_ = best.scale, converged_ = best.converged, state_ = best.state, models_ = best.models;
    const Eigen::Index n = best.root.rows();
    root_of_other_scales_.resize(n, Eigen::Index(all.size() - 1) * (n + 1));
    double sum = 0;
    Eigen::Index column = 0;
    for (const Found& found : all) {
      const double weight = std::exp(found.evidence - best.evidence);
      sum += weight;
      if (&found == &best) continue;
      root_of_other_scales_.middleCols(column, n) = std::sqrt(weight) * found.root;
      root_of_other_scales_.col(column + n) = std::sqrt(weight) * way_to(found.state);
      column += n + 1;
    }
    weight_ = 1 / sum;
    root_of_other_scales_ /= std::sqrt(sum);
  }

  /// A bone whose outline is off by kOutline_px on both sides looks larger or smaller, so it seems to lie at another
  /// depth: for a shaft by millimetres. If the reference were taken at its word, another camera, which is right, would
  /// be moved to agree. So the reference may move along its depth by as much. How many mm this is follows from the
  /// cost: a shift along the depth changes it as much less than one across as the bone is smaller than its distance.
  void doubt_depth_of_reference() {
    for (std::size_t v = 0; v < views_.size(); ++v) {
      if (views_.name(v) != options_.reference_view) continue;
      Eigen::Matrix3d curvature = Eigen::Matrix3d::Zero();  // along u, v and the depth
      for (std::size_t f = 0; f < poses_.size(); ++f) {
        const Eigen::Matrix3d to_bone = (state_.poses[f].rotation * poses_[f].frame.axes).transpose() * sights_[v].axes;
        curvature += to_bone.transpose() * models_[f * views_.size() + v].curvature.bottomRightCorner<3, 3>() * to_bone;
      }
      const double across = std::max(curvature(0, 0), curvature(1, 1)),
                   along = std::max(curvature(2, 2), 1e-6 * across);
      const double outline_mm = kOutline_px * pixel_size_at_mm(views_[v].camera, sights_[v].centre_mm);
      double& depth_variance = sights_[v].covariance(5, 5);
      if (across > 0) depth_variance = std::max(depth_variance, outline_mm * outline_mm * across / along);
    }
    prior_.emplace(sights_);
  }

  /// From the state to another one, in degrees and mm.
  Eigen::VectorXd way_to(const State& other) const {
    Eigen::VectorXd way(at_motion(views_.size()));
    for (std::size_t f = 0; f < poses_.size(); ++f)
      way.segment<6>(at_pose(f)) = from_units(Vector6d::Ones())
                                       .cwiseInverse()
                                       .cwiseProduct(motion_between(state_.poses[f], other.poses[f], poses_[f].frame));
    for (std::size_t v = 0; v < views_.size(); ++v) way.segment<6>(at_motion(v)) = other.motions[v] - state_.motions[v];
    return way;
  }

  static Eigen::Index at_pose(std::size_t bone) { return 6 * Eigen::Index(bone); }
  Eigen::Index at_motion(std::size_t view) const { return 6 * Eigen::Index(poses_.size() + view); }

  Eigen::VectorXd all_motions(const State& state) const {
    Eigen::VectorXd motions(6 * Eigen::Index(views_.size()));
    for (std::size_t v = 0; v < views_.size(); ++v) motions.segment<6>(6 * Eigen::Index(v)) = state.motions[v];
    return motions;
  }

  RigidTransform seen(const State& state, std::size_t bone, std::size_t view) const {
    return sights_[view].motion(state.motions[view]) * state.poses[bone];
  }

  /// Minus the logarithm of the posterior density, for the costs of the bones in the views.
  double energy(const State& state, const std::vector<double>& costs) const {
    const Eigen::VectorXd motions = all_motions(state);
    double sum = 0.5 * motions.dot(prior_->inverse_covariance(scale_) * motions);
    for (std::size_t i = 0; i < costs.size(); ++i) sum += costs[i] / noise_[i / views_.size()];
    return sum;
  }
  /// Of the present state, whose costs the models hold.
  double energy() const {
    std::vector<double> costs;
    for (const Model& model : models_) costs.push_back(model.value);
    return energy(state_, costs);
  }
  std::vector<double> costs_at(const State& state) const {
    std::vector<double> costs(in_views_.size());
    tbb::parallel_for(std::size_t(0), costs.size(), [&](std::size_t i) {
      costs[i] = in_views_[i].value(seen(state, i / views_.size(), i % views_.size()));
    });
    return costs;
  }

  /// Moves the models, which already hold the state's costs, to the state. Their curvatures stay.
  void move_models() {
    for (std::size_t i = 0; i < models_.size(); ++i)
      in_views_[i].move(models_[i], seen(state_, i / views_.size(), i % views_.size()));
  }

  /// Computes the models again and, if wanted, the noise of each cost. The noise is twice the rise of the cost,
  /// averaged over six directions, when the pose moves as far as the scatter of the cost's blocks predicts (as for the
  /// predicted covariance of a registration). It is doubled again, because blocks do not see an error that several of
  /// them share (docs/results.md).
  void expand(bool with_noise) {
    constexpr double kWantedRise = 2.5, kUnseen = 2;  // the rise in units of the noise
    for (std::size_t f = 0; f < poses_.size(); ++f) {
      Matrix6d curvature = Matrix6d::Zero(), scatter = Matrix6d::Zero();
      for (std::size_t v = 0; v < views_.size(); ++v) {
        Model& model = models_[f * views_.size() + v];
        model = in_views_[f * views_.size() + v].model_at(seen(state_, f, v), kWantedRise * noise_[f], with_noise);
        curvature += model.curvature;
        scatter += model.scatter;
      }
      if (!with_noise) continue;
      const Matrix6d ridge = 1e-6 * curvature.trace() * Matrix6d::Identity();
      noise_[f] = std::max(1e-12, kUnseen * (inverse_of_symmetric(curvature + ridge) * scatter).trace() / 6);
    }
  }

  /// Curvature and gradient of the energy over all poses and motions.
  std::pair<Eigen::MatrixXd, Eigen::VectorXd> equations() const {
    const Eigen::Index n = at_motion(views_.size());
    Eigen::MatrixXd a = Eigen::MatrixXd::Zero(n, n);
    Eigen::VectorXd b = Eigen::VectorXd::Zero(n);
    const Eigen::MatrixXd weight = prior_->inverse_covariance(scale_);
    a.bottomRightCorner(weight.rows(), weight.cols()) = weight;
    b.tail(weight.rows()) = weight * all_motions(state_);
    for (std::size_t v = 0; v < views_.size(); ++v) {
      const Eigen::Index m = at_motion(v);
      for (std::size_t f = 0; f < poses_.size(); ++f) {
        const Model& model = models_[f * views_.size() + v];
        const Matrix6d change = sights_[v].of_bone(state_.poses[f], poses_[f].frame), h = model.curvature / noise_[f];
        const Vector6d g = model.gradient / noise_[f];
        const Eigen::Index p = at_pose(f);
        a.block<6, 6>(p, p) += h;
        a.block<6, 6>(p, m) += h * change;
        a.block<6, 6>(m, p) += change.transpose() * h;
        a.block<6, 6>(m, m) += change.transpose() * h * change;
        b.segment<6>(p) += g;
        b.segment<6>(m) += change.transpose() * g;
      }
    }
    return {a, b};
  }

  /// Goes on until a step makes the state hardly more probable. The noise is measured in the first two rounds, if
  /// wanted. Later rounds keep the curvatures. `first` receives the first models; if it already holds some, they are
  /// those of the state.
  bool descend(bool with_noise, Context& context, std::vector<Model>& first) {
    for (int round = 0; round < options_.max_iterations; ++round) {
      context.check_cancelled();
      context.progress(double(round) / options_.max_iterations, "rounds");
      if (round == 0 ? first.empty() : with_noise && round == 1)
        expand(with_noise);
      else if (round > 0)
        move_models();
      if (round == 0) first = models_;
      if (step() < 0.05) return true;
    }
    return false;
  }

  /// The logarithm of the marginal likelihood of the scale, by Laplace's approximation about the state; without a
  /// constant.
  double evidence() const {
    double sum = prior_->log_factor(scale_) - energy();
    for (const double value : eigen_of_symmetric<Eigen::Dynamic>(equations().first).values)
      sum -= 0.5 * std::log(std::max(value, 1e-9));
    return sum;
  }

  State after(const Eigen::VectorXd& step) const {
    State state = state_;
    for (std::size_t f = 0; f < poses_.size(); ++f)
      state.poses[f] = moved(state.poses[f], poses_[f].frame, from_units(step.segment<6>(at_pose(f))));
    for (std::size_t v = 0; v < views_.size(); ++v) state.motions[v] += step.segment<6>(at_motion(v));
    return state;
  }

  /// Goes to a state of less energy, and returns by how much less; 0 if there is none.
  double step() {
    const auto [a, b] = equations();
    const double before = energy();
    for (double damping = 1e-6; damping < 1e4; damping *= 30) {
      Eigen::MatrixXd damped = a;
      damped.diagonal() *= 1 + damping;
      damped.diagonal().array() += 1e-9;
      const Eigen::VectorXd x = solve_symmetric<Eigen::Dynamic>(damped, -b);
      if (!(x.cwiseAbs().maxCoeff() < 20)) continue;
      const State next = after(x);
      const std::vector<double> costs = costs_at(next);
      const double gain = before - energy(next, costs);
      if (!(gain > 0)) continue;
      state_ = next;
      for (std::size_t i = 0; i < models_.size(); ++i) models_[i].value = costs[i];
      return gain;
    }
    return 0;
  }

  const List<Cost>& costs_;
  const List<Pose>& poses_;
  const List<View>& views_;
  const Options& options_;
  std::vector<Sight> sights_;
  std::optional<CameraPrior> prior_;
  std::vector<std::shared_ptr<const Cost>> levels_;
  std::vector<BoneInView> in_views_;  ///< of the first bone in each view, then of the next
  std::vector<Model> models_;
  std::vector<double> noise_;  ///< of each bone's cost in one view
  State state_;
  std::optional<State> given_;  ///< after a search: the state before it
  double scale_ = 1;            ///< of the deviations that the options expect of the cameras relative to each other
  double weight_ = 1;           ///< the probability of this scale
  Eigen::MatrixXd root_of_other_scales_;
  bool converged_ = false;
  Eigen::MatrixXd root_;  ///< the covariance of all poses and motions, in degrees and mm, is root_ * its transpose
};

}  // namespace marrow::refine
