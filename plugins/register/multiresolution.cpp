// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <marrow/plugin.hpp>
#include <numeric>

#include "predicted_covariance.hpp"

namespace {

struct Options {
  double scan_rotation_deg = 15;
  double scan_rotation_step_deg = 3;
  double scan_translation_mm = 15;
  double scan_translation_step_mm = 3;
  int scan_poses = 0;
  double scan_side_deg = 3;
  double scan_side_mm = 3;
  int candidates = 3;
  int finalists = 1;
  std::vector<double> contour_spacing_px{8, 4, 2};
  std::vector<double> reach_px{24, 12, 6};
  std::vector<double> pixel_step;
  std::vector<double> step_deg{3, 1, 0.3};
  std::vector<double> step_axial_deg{6, 3, 1};
  std::vector<double> step_mm{3, 1, 0.3};
  int max_evaluations = 400;
  std::vector<double> step_tolerance{0.1, 0.1, 0.03};
  double warn_above_deg = 3;
  double warn_above_mm = 5;
};

struct Result {
  marrow::Pose pose;
  marrow::List<marrow::Pose> stages;
};

constexpr int kAxialRotation = 2, kAxialTranslation = 5;
const std::vector<int> kAllAxes{0, 1, 2, 3, 4, 5};

using Levels = std::vector<std::shared_ptr<const marrow::Cost>>;

/// Where a candidate came to: cost, and poses after the axial and after the last search.
struct Found {
  double value;
  marrow::RigidTransform axial, pose;
};

/// Motions about the start that are tried first, in degrees and mm, and how far apart two of them count as neighbours.
struct Scan {
  std::vector<marrow::Vector6d> motions;
  marrow::Vector6d reach;  ///< half axes of an ellipsoid; of a grid, half sides of a box
  bool grid = true;

  bool near(int a, int b) const {
    const marrow::Vector6d way = (motions[std::size_t(a)] - motions[std::size_t(b)]).cwiseQuotient(reach);
    return (grid ? way.cwiseAbs().maxCoeff() : way.norm()) <= 1;
  }
};

/// A grid of axial rotations and translations, which the first stage leaves open.
Scan axial_scan(const Options& options) {
  const auto steps = [](double range, double step) { return int(std::floor(range / step + 1e-9)); };
  const int turns = steps(options.scan_rotation_deg, options.scan_rotation_step_deg);
  const int shifts = steps(options.scan_translation_mm, options.scan_translation_step_mm);
  Scan scan;
  for (int turn = -turns; turn <= turns; ++turn)
    for (int shift = -shifts; shift <= shifts; ++shift) {
      marrow::Vector6d motion = marrow::Vector6d::Zero();
      motion[kAxialRotation] = turn * options.scan_rotation_step_deg;
      motion[kAxialTranslation] = shift * options.scan_translation_step_mm;
      scan.motions.push_back(motion);
    }
  scan.reach = marrow::Vector6d::Ones();
  scan.reach[kAxialRotation] = 2.01 * options.scan_rotation_step_deg;
  scan.reach[kAxialTranslation] = 2.01 * options.scan_translation_step_mm;
  return scan;
}

/// The start, and motions about and along all six axes spread evenly over their ranges (Halton's sequence), for a start
/// that is wrong in all of them.
Scan scattered_scan(const Options& options) {
  marrow::Vector6d range;
  range << options.scan_side_deg, options.scan_side_deg, options.scan_rotation_deg, options.scan_side_mm,
      options.scan_side_mm, options.scan_translation_mm;
  const auto halton = [](int i, int base) {
    double value = 0, place = 1;
    for (; i > 0; i /= base) value += (place /= base) * (i % base);
    return value;
  };
  Scan scan;
  for (int i = 0; i < options.scan_poses; ++i) {
    marrow::Vector6d motion = marrow::Vector6d::Zero();
    constexpr std::array<int, 6> kBases{2, 3, 5, 7, 11, 13};
    for (int axis = 0; i > 0 && axis < 6; ++axis)
      motion[axis] = range[axis] * (2 * halton(i, kBases[std::size_t(axis)]) - 1);
    scan.motions.push_back(motion);
  }
  scan.reach = 0.5 * range.cwiseMax(1e-9);
  scan.grid = false;
  return scan;
}

/// The search: the pose found so far, moved about the fragment's own axes.
class Search {
 public:
  Search(const marrow::Optimizer& optimizer, const marrow::Pose& initial, const Options& options,
         marrow::Context& context)
      : optimizer_(optimizer),
        frame_(initial.frame),
        pose_(initial.world_from_model),
        options_(options),
        context_(context) {}

  const marrow::RigidTransform& pose() const { return pose_; }
  void go_to(const marrow::RigidTransform& pose) { pose_ = pose; }
  int evaluations() const { return evaluations_; }

  /// The least cost on the way so far; costs of different levels do not compare, so this asks one for all.
  std::vector<marrow::Pose::Progress> convergence(const marrow::Cost& cost) const {
    std::vector<marrow::RigidTransform> poses;
    for (const auto& [evaluations, pose] : path_) poses.push_back(pose);
    const std::vector<double> values = cost.values(poses);
    std::vector<marrow::Pose::Progress> steps;
    for (std::size_t i = 0; i < values.size(); ++i)
      if (steps.empty() || values[i] < steps.back().cost) steps.push_back({path_[i].first, values[i]});
    return steps;
  }

  /// Tries the motions of a scan and returns the best poses that are no neighbours of a better one: the cost has other
  /// minima within their range.
  std::vector<marrow::RigidTransform> scan(const marrow::Cost& cost) {
    const Scan scan = options_.scan_poses > 0 ? scattered_scan(options_) : axial_scan(options_);
    std::vector<marrow::RigidTransform> poses;
    for (const marrow::Vector6d& motion : scan.motions) poses.push_back(moved_by_units(pose_, frame_, motion));
    const std::vector<double> values = cost.values(poses);
    evaluations_ += int(poses.size());
    std::vector<int> order(poses.size()), chosen;
    std::iota(order.begin(), order.end(), 0);
    std::sort(order.begin(), order.end(), [&](int a, int b) {
      return values[std::size_t(a)] != values[std::size_t(b)] ? values[std::size_t(a)] < values[std::size_t(b)] : a < b;
    });
    std::vector<marrow::RigidTransform> candidates;
    for (const int i : order) {
      if (int(candidates.size()) == options_.candidates) break;
      if (std::any_of(chosen.begin(), chosen.end(), [&](int other) { return scan.near(i, other); })) continue;
      chosen.push_back(i);
      candidates.push_back(poses[std::size_t(i)]);
    }
    return candidates;
  }

  /// Minimises over the given axes from the pose found so far, goes there and returns the cost.
  double refine(const marrow::Cost& cost, const std::vector<int>& axes, std::size_t level, double done, double share) {
    const auto n = Eigen::Index(axes.size());
    const auto pose_at = [&](const Eigen::VectorXd& x) {
      marrow::Vector6d motion = marrow::Vector6d::Zero();
      for (Eigen::Index i = 0; i < n; ++i) motion[axes[std::size_t(i)]] = x[i];
      return moved_by_units(pose_, frame_, motion);
    };
    marrow::MinimisationProblem problem;
    problem.start = Eigen::VectorXd::Zero(n);
    problem.initial_step.resize(n);
    for (Eigen::Index i = 0; i < n; ++i) {
      const int axis = axes[std::size_t(i)];
      problem.initial_step[i] = axis == kAxialRotation ? options_.step_axial_deg[level]
                                : axis < 3             ? options_.step_deg[level]
                                                       : options_.step_mm[level];
    }
    problem.max_evaluations = options_.max_evaluations;
    problem.step_tolerance = options_.step_tolerance[level];
    problem.function = [&](const Eigen::VectorXd& x) {
      context_.check_cancelled();
      return cost.value(pose_at(x));
    };
    double least = std::numeric_limits<double>::infinity();
    problem.observer = [&](int evaluation, const Eigen::VectorXd& x, double value) {
      if (value < least) note(evaluations_ + evaluation, pose_at(x));
      least = std::min(least, value);
      if (evaluation % 50 == 0)
        context_.progress(done + share * std::min(1.0, double(evaluation) / options_.max_evaluations), "registration");
    };
    const marrow::MinimisationResult result = optimizer_.minimise(problem);
    evaluations_ += result.evaluations;
    pose_ = pose_at(result.x);
    path_.push_back({evaluations_, pose_});
    return result.value;
  }

  /// Follows the candidates up. Each is judged after all six axes had their turn, because the start's errors in the
  /// other four hide which of them is right; the finalists are judged at the last level, because a coarse cost hardly
  /// tells a good pose from one whose outline lies on other things in the image.
  Found best_of(const std::vector<marrow::RigidTransform>& candidates, const Levels& levels) {
    const std::size_t finalists = std::min(candidates.size(), std::size_t(options_.finalists));
    const double share = 1.0 / double(candidates.size() + finalists * (levels.size() - 1));
    double done = 0;
    std::vector<Found> found;
    for (const marrow::RigidTransform& candidate : candidates) {
      go_to(candidate);
      refine(*levels.front(), {kAxialRotation, kAxialTranslation}, 0, done, share / 2);
      const marrow::RigidTransform axial = pose_;
      const double value = refine(*levels.front(), kAllAxes, 0, done + share / 2, share / 2);
      found.push_back({value, axial, pose_});
      done += share;
    }
    const auto better = [](const Found& a, const Found& b) { return a.value < b.value; };
    std::stable_sort(found.begin(), found.end(), better);
    found.resize(finalists);
    for (Found& finalist : found) {
      go_to(finalist.pose);
      for (std::size_t i = 1; i < levels.size(); ++i, done += share)
        finalist.value = refine(*levels[i], kAllAxes, i, done, share);
      finalist.pose = pose_;
    }
    return *std::min_element(found.begin(), found.end(), better);
  }

 private:
  /// Keeps a pose of the way, one in ten evaluations at most.
  void note(int evaluations, const marrow::RigidTransform& pose) {
    if (path_.empty() || evaluations >= path_.back().first + 10) path_.push_back({evaluations, pose});
  }

  const marrow::Optimizer& optimizer_;
  const marrow::FragmentFrame& frame_;
  marrow::RigidTransform pose_;
  const Options& options_;
  marrow::Context& context_;
  int evaluations_ = 0;
  std::vector<std::pair<int, marrow::RigidTransform>> path_;  ///< after so many evaluations
};

void check_options(const Options& options) {
  const std::size_t levels = options.contour_spacing_px.size();
  const auto check = [&](const std::vector<double>& values, const char* name) {
    if (values.empty() || values.size() != levels)
      throw marrow::Error(std::string(name) + " has " + std::to_string(values.size()) +
                          " numbers, but contour_spacing_px has " + std::to_string(levels) +
                          "; give reach_px and the four options of steps as many, one for each level");
    for (const double value : values)
      if (!(value > 0)) throw marrow::Error(std::string(name) + ": each number must be positive");
  };
  check(options.contour_spacing_px, "contour_spacing_px");
  check(options.reach_px, "reach_px");
  if (!options.pixel_step.empty()) check(options.pixel_step, "pixel_step");
  check(options.step_deg, "step_deg");
  check(options.step_axial_deg, "step_axial_deg");
  check(options.step_mm, "step_mm");
  check(options.step_tolerance, "step_tolerance");
}

Result multiresolution(const marrow::Cost& cost, const marrow::Optimizer& optimizer, const marrow::Pose& initial,
                       const Options& options, marrow::Context& context) {
  check_options(options);
  marrow::check_rigid(initial.world_from_model, "the pose to start from");
  Levels levels;
  for (std::size_t i = 0; i < options.contour_spacing_px.size(); ++i)
    levels.push_back(cost.at_level({options.contour_spacing_px[i], options.reach_px[i], options.pixel_step.empty() ? 0 : int(options.pixel_step[i])}));
  Search search(optimizer, initial, options, context);

  Result result;
  const auto pose_now = [&] {
    marrow::Pose pose = initial;
    pose.world_from_model = search.pose();
    pose.covariance.reset();
    pose.cost = levels.back()->value(search.pose());
    pose.evaluations = search.evaluations();
    return pose;
  };
  result.stages.add("start", pose_now());
  const Found best = search.best_of(search.scan(*levels.front()), levels);
  search.go_to(best.axial);
  result.stages.add("axial", pose_now());
  search.go_to(best.pose);
  result.pose = pose_now();
  result.pose.convergence = search.convergence(*levels.back());

  if (const auto factor = levels.back()->likelihood_factor(search.pose())) {
    const PredictedCovariance predicted(*levels.back(), search.pose(), initial.frame, *factor);
    result.pose.covariance = predicted.covariance();
    result.pose.evaluations += predicted.evaluations();
    for (const std::string& warning : predicted.warnings(options.warn_above_deg, options.warn_above_mm)) {
      context.warn(warning);
      result.pose.warnings.push_back(warning);
    }
  }
  result.stages.add("final", result.pose);
  return result;
}

}  // namespace

MARROW_PLUGIN(plugin) {
  plugin.node("register.multiresolution", multiresolution)
      .summary("Coarse to fine: first axial rotation and translation, then all six, with shrinking steps")
      .in("cost", "what a pose costs")
      .in("optimizer", "minimiser without derivatives")
      .in("initial", "pose to start from, and the fragment's axes")
      .out("pose", &Result::pose, "pose of least cost, with its predicted covariance")
      .out("stages", &Result::stages, "poses on the way: start, axial, final", marrow::over("stage"))
      .option("scan_rotation_deg", &Options::scan_rotation_deg, "axial rotations tried, to either side",
              marrow::at_least(0), marrow::at_most(180))
      .option("scan_rotation_step_deg", &Options::scan_rotation_step_deg, "distance between these",
              marrow::at_least(0.01))
      .option("scan_translation_mm", &Options::scan_translation_mm, "axial translations tried, to either side",
              marrow::at_least(0))
      .option("scan_translation_step_mm", &Options::scan_translation_step_mm, "distance between these",
              marrow::at_least(0.01))
      .option("scan_poses", &Options::scan_poses,
              "instead of this grid, so many poses spread over all six axes: for a start that is approximate in all",
              marrow::at_least(0))
      .option("scan_side_deg", &Options::scan_side_deg,
              "of these, rotations about the frontal and lateral axes, to either side", marrow::at_least(0),
              marrow::at_most(180))
      .option("scan_side_mm", &Options::scan_side_mm, "of these, translations along the same axes, to either side",
              marrow::at_least(0))
      .option("candidates", &Options::candidates, "best places of this scan that are followed up", marrow::at_least(1))
      .option("finalists", &Options::finalists,
              "best of these after the first level that go through all levels; the last level chooses",
              marrow::at_least(1))
      .option("contour_spacing_px", &Options::contour_spacing_px, "per level: distance between points of the outline")
      .option("reach_px", &Options::reach_px, "per level: distance from which on a point counts as unmatched")
      .option("pixel_step", &Options::pixel_step, "per level, of grey values: every how many pixels are compared; none: as the cost says")
      .option("step_deg", &Options::step_deg,
              "per level: first step of the rotations about the frontal and lateral axes")
      .option("step_axial_deg", &Options::step_axial_deg,
              "per level: first step of the axial rotation, which moves the outline less")
      .option("step_mm", &Options::step_mm, "per level: first step of the translations")
      .option("max_evaluations", &Options::max_evaluations, "most evaluations of the cost per level",
              marrow::at_least(1))
      .option("step_tolerance", &Options::step_tolerance,
              "per level: it ends when steps fall below this part of its first step")
      .option("warn_above_deg", &Options::warn_above_deg,
              "predicted standard deviation of a rotation that gives a warning", marrow::at_least(0))
      .option("warn_above_mm", &Options::warn_above_mm,
              "predicted standard deviation of a translation that gives a warning", marrow::at_least(0));
}
