// SPDX-License-Identifier: Apache-2.0
#include "marrow/toolbox/search/search.hpp"

#include <numeric>

#include "predicted_covariance.hpp"

namespace marrow::search {

void check_level_list(const std::vector<double>& values, const std::string& name) {
  if (values.empty()) throw Error(name + ": there is no level; give a number for one at least");
  for (const double value : values)
    if (!(value > 0)) throw Error(name + ": each number must be positive");
}

void check_options(const SearchOptions& options) {
  check_level_list(options.contour_spacing_px, "contour_spacing_px");
  check_level_list(options.reach_px, "reach_px");
  if (!options.pixel_step.empty()) check_level_list(options.pixel_step, "pixel_step");
  check_level_list(options.step_deg, "step_deg");
  check_level_list(options.step_axial_deg, "step_axial_deg");
  check_level_list(options.step_mm, "step_mm");
  check_level_list(options.step_tolerance, "step_tolerance");
}

Levels levels_of(const Cost& cost, const SearchOptions& options) {
  Levels levels;
  for (std::size_t i = 0; i < options.contour_spacing_px.size(); ++i)
    levels.push_back(cost.at_level({options.contour_spacing_px[i], options.reach_px.at(i),
                                    options.pixel_step.empty() ? 0 : int(options.pixel_step.at(i))}));
  return levels;
}

Search::Search(const Optimizer& optimizer, const Pose& initial, const SearchOptions& options, Context& context)
    : optimizer_(optimizer),
      frame_(initial.frame),
      pose_(initial.world_from_model),
      options_(options),
      context_(context) {}

std::vector<Pose::Progress> Search::convergence(const Cost& cost) const {
  std::vector<RigidTransform> poses;
  for (const auto& [evaluations, pose] : path_) poses.push_back(pose);
  const std::vector<double> values = cost.values(poses);
  std::vector<Pose::Progress> steps;
  for (std::size_t i = 0; i < values.size(); ++i)
    if (steps.empty() || values[i] < steps.back().cost) steps.push_back({path_[i].first, values[i]});
  return steps;
}

std::vector<RigidTransform> Search::scan(const Cost& cost) {
  const Scan scan = options_.scan_poses > 0 ? scattered_scan(options_) : axial_scan(options_);
  std::vector<RigidTransform> poses;
  for (const Vector6d& motion : scan.motions) poses.push_back(moved_by_units(pose_, frame_, motion));
  std::vector<double> values = cost.values(poses);
  for (double& value : values)
    if (std::isnan(value)) value = std::numeric_limits<double>::infinity();  // nothing can be sorted among NaN
  evaluations_ += int(poses.size());
  std::vector<int> order(poses.size()), chosen;
  std::iota(order.begin(), order.end(), 0);
  std::sort(order.begin(), order.end(), [&](int a, int b) {
    return values[std::size_t(a)] != values[std::size_t(b)] ? values[std::size_t(a)] < values[std::size_t(b)] : a < b;
  });
  std::vector<RigidTransform> candidates;
  for (const int i : order) {
    if (int(candidates.size()) == options_.candidates) break;
    if (std::any_of(chosen.begin(), chosen.end(), [&](int other) { return scan.near(i, other); })) continue;
    chosen.push_back(i);
    candidates.push_back(poses[std::size_t(i)]);
  }
  return candidates;
}

double Search::refine(const Cost& cost, const std::vector<int>& axes, const Steps& steps, double done, double share) {
  const auto n = Eigen::Index(axes.size());
  const auto motion_at = [&](const Eigen::VectorXd& x) {
    Vector6d motion = Vector6d::Zero();
    for (Eigen::Index i = 0; i < n; ++i) motion[axes[std::size_t(i)]] = x[i];
    return motion;
  };
  const auto pose_at = [&](const Eigen::VectorXd& x) { return moved_by_units(pose_, frame_, motion_at(x)); };
  MinimisationProblem problem;
  problem.start = Eigen::VectorXd::Zero(n);
  problem.initial_step.resize(n);
  for (Eigen::Index i = 0; i < n; ++i) {
    const int axis = axes[std::size_t(i)];
    const bool is_axial = axis == kAxialRotation && frame_.is_anatomical;
    problem.initial_step[i] = is_axial ? steps.axial_deg : axis < 3 ? steps.deg : steps.mm;
  }
  problem.max_evaluations = options_.max_evaluations;
  problem.step_tolerance = steps.tolerance;
  problem.function = [&](const Eigen::VectorXd& x) {
    context_.check_cancelled();
    return cost.value(pose_at(x));
  };
  if (const auto at_start = cost.expansion(pose_, frame_))
    problem.expansion = [&, at_start](const Eigen::VectorXd& x) {
      context_.check_cancelled();
      return in_coordinates(x.isZero(0) ? at_start : cost.expansion(pose_at(x), frame_), motion_at(x), axes);
    };
  double least = std::numeric_limits<double>::infinity();
  problem.observer = [&](int evaluation, const Eigen::VectorXd& x, double value) {
    if (value < least) note(evaluations_ + evaluation, pose_at(x));
    least = std::min(least, value);
    if (evaluation % 50 == 0)
      context_.progress(done + share * std::min(1.0, double(evaluation) / options_.max_evaluations), "registration");
  };
  const MinimisationResult result = optimizer_.minimise(problem);
  evaluations_ += result.evaluations;
  pose_ = pose_at(result.x);
  path_.push_back({evaluations_, pose_});
  return result.value;
}

Found Search::best_of(const std::vector<RigidTransform>& candidates, const Levels& levels) {
  const std::size_t finalists = std::min(candidates.size(), std::size_t(options_.finalists));
  const double share = 1.0 / double(candidates.size() + finalists * (levels.size() - 1));
  double done = 0;
  std::vector<Found> found;
  for (const RigidTransform& candidate : candidates) {
    go_to(candidate);
    refine(*levels.front(), {kAxialRotation, kAxialTranslation}, steps_of(0), done, share / 2);
    const RigidTransform axial = pose_;
    const double value = refine(*levels.front(), kAllAxes, steps_of(0), done + share / 2, share / 2);
    found.push_back({value, axial, pose_});
    done += share;
  }
  const auto better = [](const Found& a, const Found& b) { return a.value < b.value; };
  std::stable_sort(found.begin(), found.end(), better);
  found.resize(finalists);
  for (Found& finalist : found) {
    go_to(finalist.pose);
    for (std::size_t i = 1; i < levels.size(); ++i, done += share)
      finalist.value = refine(*levels[i], kAllAxes, steps_of(i), done, share);
    finalist.pose = pose_;
  }
  return *std::min_element(found.begin(), found.end(), better);
}

/// Keeps a pose on the way, at most one in ten evaluations.
void Search::note(int evaluations, const RigidTransform& pose) {
  if (path_.empty() || evaluations >= path_.back().first + 10) path_.push_back({evaluations, pose});
}

Steps Search::steps_of(std::size_t level) const {
  return {options_.step_deg.at(level), options_.step_axial_deg.at(level), options_.step_mm.at(level),
          options_.step_tolerance.at(level)};
}

Pose pose_of(const Search& search, const Pose& initial, const Cost& cost) {
  Pose pose = initial;
  pose.world_from_model = search.pose();
  pose.covariance.reset();
  pose.cost = cost.value(search.pose());
  pose.evaluations = search.evaluations();
  return pose;
}

namespace {

/// The sum of the variances, of the rotations in square degrees and of the translations in square mm.
double size_of(const PredictedCovariance& predicted) {
  const Vector6d variance = predicted.covariance()->diagonal();
  const double sum = degrees(degrees(variance.head<3>().sum())) + variance.tail<3>().sum();
  return std::isfinite(sum) ? sum : std::numeric_limits<double>::infinity();
}

/// A cost whose own derivatives do not tell how it rises is rough: a few hundredths of a degree away, the same
/// prediction may be several times as large. So it is made at five poses next to each other, and the median is taken.
/// This depends on the pose, and not on the point of the rough ground where the search happened to stop. What nothing
/// determines stays undetermined.
PredictedCovariance on_rough_ground(const PredictedCovariance& at_pose, const Cost& cost, const RigidTransform& pose,
                                    const FragmentFrame& frame, int& evaluations) {
  constexpr double kStep = 0.03;  // degrees and mm
  constexpr int kSenses[4][6] = {
      {1, 1, 1, 1, 1, 1}, {1, -1, -1, 1, -1, -1}, {-1, 1, -1, -1, 1, -1}, {-1, -1, 1, -1, -1, 1}};
  constexpr double kUnknown = 90;  // degrees and mm
  if (size_of(at_pose) > kUnknown * kUnknown) return at_pose;
  std::vector<PredictedCovariance> all{at_pose};
  for (const auto& senses : kSenses) {
    Vector6d motion;
    for (int axis = 0; axis < 6; ++axis) motion[axis] = kStep * senses[axis];
    const PredictedCovariance beside(cost, moved_by_units(pose, frame, motion), frame);
    evaluations += beside.evaluations();
    if (!beside.is_by_derivatives()) all.push_back(beside);
  }
  std::vector<std::size_t> order(all.size());
  std::iota(order.begin(), order.end(), std::size_t(0));
  std::stable_sort(order.begin(), order.end(),
                   [&](std::size_t a, std::size_t b) { return size_of(all[a]) < size_of(all[b]); });
  return all[order[order.size() / 2]];
}

/// Goes to the best of the minima along the least certain direction, and predicts the covariance there.
PredictedCovariance settle(Search& search, const FragmentFrame& frame, const Cost& cost, const Cost* coarser,
                           const Steps& steps, int& evaluations) {
  constexpr int kRounds = 3;
  for (int round = 1;; ++round) {
    const RigidTransform here = search.pose();
    PredictedCovariance predicted(cost, here, frame, coarser);
    evaluations += predicted.evaluations();
    RigidTransform best = here;
    double least = predicted.value();
    for (const RigidTransform& other : predicted.other_minima()) {
      if (round == kRounds) break;
      search.go_to(other);
      const double value = search.refine(cost, kAllAxes, steps, 1, 0);
      if (value >= least) continue;
      least = value;
      best = search.pose();
    }
    search.go_to(best);
    if (least < predicted.value()) continue;
    const bool is_rough = predicted.covariance() && !predicted.is_by_derivatives() && cost.expansion(here, frame);
    return is_rough ? on_rough_ground(predicted, cost, here, frame, evaluations) : predicted;
  }
}

constexpr double kRounding = 1e-12;  // relative

/// Whether a cost is the same at all poses around. It is asked for one pose after the other, because the first one
/// tells nearly always.
bool is_constant(const Cost& cost, double here, const RigidTransform& pose, const FragmentFrame& frame) {
  for (const double step : {0.5, 4.0, 16.0})
    for (int axis = 0; axis < 6; ++axis)
      for (const double sense : {1.0, -1.0}) {
        const double there = cost.value(moved_by_units(pose, frame, sense * step * Vector6d::Unit(axis)));
        if (!(std::abs(there - here) <= kRounding * std::max(std::abs(there), std::abs(here)))) return false;
      }
  return true;
}

}  // namespace

Pose final_pose_of(Search& search, const Pose& initial, const Cost& cost, const Steps& steps,
                   const SearchOptions& options, Context& context, const Cost* coarser) {
  check_compared(cost, search.pose(), initial.frame);
  const RigidTransform before = search.pose();
  int evaluations = 0;
  const PredictedCovariance predicted = settle(search, initial.frame, cost, coarser, steps, evaluations);
  const bool has_moved =
      before.rotation != search.pose().rotation || before.translation_mm != search.pose().translation_mm;
  if (has_moved) check_compared(cost, search.pose(), initial.frame);
  if (predicted.covariance() && !predicted.covariance()->allFinite())
    refuse_pose("without some blocks of the images the cost is not a number");
  Pose pose = pose_of(search, initial, cost);
  pose.warnings.clear();  // those of the start are not of this pose
  pose.convergence = search.convergence(cost);
  pose.covariance = predicted.covariance();
  pose.evaluations += evaluations;
  for (const std::string& warning : predicted.warnings(options.warn_above_deg, options.warn_above_mm)) {
    context.warn(warning);
    pose.warnings.push_back(warning);
  }
  warn_of_silent_views(cost, pose, context);
  return pose;
}

std::string nothing_compared(const Cost& cost, const RigidTransform& pose, const FragmentFrame& frame) {
  const std::string said = cost.nothing_compared(pose);
  if (!said.empty()) return said;
  const double here = cost.value(pose);
  if (!std::isfinite(here)) return "the cost is not a number";
  return is_constant(cost, here, pose, frame) ? "the cost is the same at all poses within 16 degrees and mm" : "";
}

void refuse_pose(const std::string& why, const std::string& which) {
  throw Error("the images say nothing about " + which + ": " + why +
              "; give a start nearer to the bone, or see whether the masks, the edges and the model are right");
}

void check_compared(const Cost& cost, const RigidTransform& pose, const FragmentFrame& frame) {
  if (const std::string why = nothing_compared(cost, pose, frame); !why.empty()) refuse_pose(why);
}

void warn_of_silent_views(const Cost& cost, Pose& pose, const Context& context) {
  for (const std::string& view : cost.silent_views(pose.world_from_model)) {
    const std::string warning = view + "; only the other views count";
    if (std::find(pose.warnings.begin(), pose.warnings.end(), warning) != pose.warnings.end()) continue;
    pose.warnings.push_back(warning);
    context.warn(warning);
  }
}

}  // namespace marrow::search
