// SPDX-License-Identifier: Apache-2.0
// Several bones that the same images show. Where one overlaps another, each is found better if the other is known. So
// they are refined in turn, each among the others as they were found last, and then all at once.
#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include <functional>
#include <marrow/domain/decompositions.hpp>
#include <vector>

#include "marrow/toolbox/geometry/fragments.hpp"
#include "marrow/toolbox/match/bones_together.hpp"
#include "marrow/toolbox/search/search.hpp"

namespace {

using namespace marrow;

/// The cost of the poses of all bones.
using JointCost = std::function<double(const std::vector<RigidTransform>&)>;

/// Steps of a bone along the principal axes of its covariance, a column each, and how long they are in deviations.
struct Steps {
  std::size_t bone = 0;
  Matrix6d root;  ///< the covariance is root * root^T
  Vector6d in_deviations = Vector6d::Zero();

  Vector6d step(int axis) const { return in_deviations[axis] * root.col(axis); }
};

Steps steps_of(std::size_t bone, const Matrix6d& covariance) {
  constexpr double kDeviations = 4, kMost = 4;  // the longest step in degrees and mm
  Vector6d unit = Vector6d::Ones();
  unit.head<3>() *= degrees(1);
  const auto eigen = eigen_of_symmetric<6>(unit.asDiagonal() * covariance * unit.asDiagonal());
  Steps steps{bone, Matrix6d::Zero(), Vector6d::Zero()};
  for (int i = 0; i < 6; ++i) {
    const double deviation = std::sqrt(std::max(eigen.values[i], 1e-12));
    steps.root.col(i) = deviation * eigen.vectors.col(i).cwiseQuotient(unit);
    steps.in_deviations[i] = std::min(kDeviations, kMost / deviation);
  }
  return steps;
}

class Curvature {
 public:
  Curvature(const std::vector<Pose>& poses, const JointCost& cost) : poses_(poses), cost_(cost) {
    for (const Pose& pose : poses) at_.push_back(pose.world_from_model);
    here_ = cost(at_);
  }

  /// The second derivatives along the steps of one bone, in units of their lengths.
  Vector6d of(const Steps& a) const {
    Vector6d curvature;
    for (int i = 0; i < 6; ++i) curvature[i] = at({{a.bone, a.step(i)}}) + at({{a.bone, -a.step(i)}}) - 2 * here_;
    return curvature;
  }
  /// The mixed ones of two bones.
  Matrix6d of(const Steps& a, const Steps& b) const {
    Matrix6d mixed;
    for (int i = 0; i < 6; ++i)
      for (int j = 0; j < 6; ++j) {
        const auto both = [&](double p, double q) { return at({{a.bone, p * a.step(i)}, {b.bone, q * b.step(j)}}); };
        mixed(i, j) = 0.25 * (both(1, 1) - both(1, -1) - both(-1, 1) + both(-1, -1));
      }
    return mixed;
  }

 private:
  double at(const std::vector<std::pair<std::size_t, Vector6d>>& motions) const {
    std::vector<RigidTransform> poses = at_;
    for (const auto& [bone, motion] : motions) poses[bone] = marrow::moved(poses[bone], poses_[bone].frame, motion);
    return cost_(poses);
  }

  const std::vector<Pose>& poses_;
  const JointCost& cost_;
  std::vector<RigidTransform> at_;
  double here_ = 0;
};

/// A root of the inverse of a symmetric matrix with ones on its diagonal. Rough costs may give correlations that no
/// information has, so its eigenvalues count as this at least.
Eigen::MatrixXd root_of_inverse(const Eigen::MatrixXd& matrix) {
  constexpr double kLeast = 0.04;  // so no deviation grows more than five times
  const auto eigen = eigen_of_symmetric<Eigen::Dynamic>(matrix);
  return eigen.vectors * eigen.values.cwiseMax(kLeast).cwiseSqrt().cwiseInverse().asDiagonal();
}

/// The correlations of the curvatures of two bones along their steps.
Matrix6d correlations(const Matrix6d& mixed, const Vector6d& first, const Vector6d& second) {
  Matrix6d correlations = Matrix6d::Zero();
  for (int i = 0; i < 6; ++i)
    for (int j = 0; j < 6; ++j)
      if (first[i] > 0 && second[j] > 0)
        correlations(i, j) = std::clamp(mixed(i, j) / std::sqrt(first[i] * second[j]), -1.0, 1.0);
  return correlations;
}

/// The poses after small motions about and along their frames' axes [rad, mm], six numbers for each bone.
std::vector<RigidTransform> moved(const std::vector<Pose>& poses, const Eigen::VectorXd& motions) {
  std::vector<RigidTransform> result;
  for (std::size_t b = 0; b < poses.size(); ++b)
    result.push_back(marrow::moved(poses[b].world_from_model, poses[b].frame, motions.segment<6>(6 * Eigen::Index(b))));
  return result;
}

/// The covariance of all poses together is root * root^T; the columns are its principal axes in units of the single
/// bones' deviations. Each pose holds the covariance that it would have if all others were exact. The curvature of the
/// cost says how far a bone gives way if another one moves: with unit deviations, the information of all poses is 1 on
/// the diagonal and the correlation of the curvatures between two bones. Its inverse is the covariance whatever the
/// others do (Laplace's approximation). Empty if a pose has no finite covariance.
Eigen::MatrixXd root_of_covariance(const std::vector<Pose>& poses, const JointCost& cost) {
  std::vector<Steps> steps;
  for (std::size_t b = 0; b < poses.size(); ++b) {
    if (!poses[b].covariance || !poses[b].covariance->allFinite()) return {};
    steps.push_back(steps_of(b, *poses[b].covariance));
  }
  const Curvature curvature(poses, cost);
  std::vector<Vector6d> own;
  for (const Steps& one : steps) own.push_back(curvature.of(one));
  const auto n = 6 * Eigen::Index(steps.size());
  Eigen::MatrixXd information = Eigen::MatrixXd::Identity(n, n), deviations = Eigen::MatrixXd::Zero(n, n);
  for (std::size_t a = 0; a < steps.size(); ++a) {
    const Eigen::Index row = 6 * Eigen::Index(a);
    deviations.block<6, 6>(row, row) = steps[a].root;
    for (std::size_t b = 0; b < a; ++b) {
      const Eigen::Index column = 6 * Eigen::Index(b);
      const Matrix6d between = correlations(curvature.of(steps[a], steps[b]), own[a], own[b]);
      information.block<6, 6>(row, column) = between;
      information.block<6, 6>(column, row) = between.transpose();
    }
  }
  return deviations * root_of_inverse(information);
}

using search::Search;

struct Options {
  std::vector<double> contour_spacing_px{8, 4, 2};
  std::vector<double> reach_px{24, 12, 6};
  std::vector<double> pixel_step;
  std::vector<double> step_deg{3, 1, 0.3};
  std::vector<double> step_axial_deg{6, 2, 0.6};
  std::vector<double> step_mm{3, 1, 0.3};
  double step_tolerance = 0.03;
  int max_evaluations = 400;
  int max_rounds = 4;
  double warn_above_deg = 3;
  double warn_above_mm = 5;
};

struct Result {
  Pose pose;
  List<Pose> stages, poses;
};

search::SearchOptions search_options(const Options& options) {
  search::SearchOptions result;
  result.contour_spacing_px = options.contour_spacing_px;
  result.reach_px = options.reach_px;
  result.pixel_step = options.pixel_step;
  result.step_deg = options.step_deg;
  result.step_axial_deg = options.step_axial_deg;
  result.step_mm = options.step_mm;
  result.step_tolerance.assign(options.step_deg.size(), options.step_tolerance);
  result.max_evaluations = options.max_evaluations;
  result.warn_above_deg = options.warn_above_deg;
  result.warn_above_mm = options.warn_above_mm;
  search::check_options(result);
  return result;
}

class Together {
 public:
  Together(const List<Cost>& costs, const List<Pose>& starts, const Optimizer& optimizer, const Options& options,
           Context& context)
      : starts_(starts),
        optimizer_(optimizer),
        options_(options),
        search_options_(search_options(options)),
        context_(context) {
    for (std::size_t b = 0; b < starts.size(); ++b) {
      at_.push_back(starts[b].world_from_model);
      levels_.push_back(search::levels_of(costs[b], search_options_));
      evaluations_.push_back(0);
    }
  }

  std::vector<Pose> run() {
    for (std::size_t level = 0; level < level_count(); ++level) {
      for (int round = 0; round < options_.max_rounds; ++round)
        if (!in_turn(level, round)) break;
    }
    return finished();
  }

 private:
  std::size_t level_count() const { return search_options_.step_deg.size(); }

  /// A bone's cost with all others where `poses` says. The bones' names are those of the starts.
  std::shared_ptr<const Cost> among(std::size_t bone, std::size_t level,
                                    const std::vector<RigidTransform>& poses) const {
    List<RigidTransform> others;
    for (std::size_t b = 0; b < poses.size(); ++b)
      if (b != bone) others.add(starts_.name(b), poses[b]);
    const std::shared_ptr<const Cost>& own = levels_[bone][level];
    const std::shared_ptr<const Cost> cost = match::among_others(*own, others);
    return cost ? cost : own;
  }

  /// The mean cost of all bones.
  double mean_cost(std::size_t level, const std::vector<RigidTransform>& poses) const {
    double sum = 0;
    for (std::size_t b = 0; b < poses.size(); ++b) sum += among(b, level, poses)->value(poses[b]);
    return sum / double(poses.size());
  }

  /// Refines each bone among the others. Returns whether another round may move one: the last moved more than the
  /// search's tolerance, and there are others.
  bool in_turn(std::size_t level, int round) {
    bool has_moved = false;
    for (std::size_t b = 0; b < at_.size(); ++b) {
      Search search(optimizer_, starts_[b], search_options_, context_);
      search.go_to(at_[b]);
      search::Steps steps = search.steps_of(level);
      if (round > 0) steps.deg *= 0.3, steps.axial_deg *= 0.3, steps.mm *= 0.3;
      const std::shared_ptr<const Cost> cost = among(b, level, at_);
      search.refine(*cost, search::kAllAxes, steps, double(level) / double(level_count()), 0.1);
      evaluations_[b] += search.evaluations();
      const Vector6d motion = motion_between(at_[b], search.pose(), starts_[b].frame);
      has_moved = has_moved || degrees(motion.head<3>().norm()) > options_.step_tolerance * steps.deg ||
                  motion.tail<3>().norm() > options_.step_tolerance * steps.mm;
      at_[b] = search.pose();
    }
    return has_moved && at_.size() > 1;
  }

  /// Each bone's pose with the covariance that it has among the others; then all of them at once, with what the others
  /// add.
  std::vector<Pose> finished() {
    const std::size_t level = level_count() - 1;
    std::vector<Pose> poses;
    for (std::size_t b = 0; b < at_.size(); ++b) {
      Search search(optimizer_, starts_[b], search_options_, context_);
      search.go_to(at_[b]);
      const std::shared_ptr<const Cost> cost = among(b, level, at_);
      poses.push_back(final_pose_of(search, starts_[b], *cost, search.steps_of(level), search_options_, context_));
      at_[b] = search.pose();
      poses[b].evaluations += evaluations_[b];
    }
    if (poses.size() > 1) at_once(poses);
    return poses;
  }

  /// Minimises the mean cost over the poses of all bones. Rounds in turn are slow where two bones give way to each
  /// other. Along the principal axes of all poses together, in units of their deviations, the search is not. Without
  /// deviations, the rounds in turn are all that there is.
  void at_once(std::vector<Pose>& poses) {
    constexpr double kStep = 1, kTolerance = 0.02;  // deviations
    const std::size_t level = level_count() - 1;
    const JointCost cost = [&](const std::vector<RigidTransform>& at) {
      context_.check_cancelled();
      return mean_cost(level, at);
    };
    const Eigen::MatrixXd root = root_of_covariance(poses, cost);
    if (root.size() == 0) return;
    MinimisationProblem problem;
    problem.start = Eigen::VectorXd::Zero(root.cols());
    problem.initial_step = Eigen::VectorXd::Constant(root.cols(), kStep);
    problem.max_evaluations = options_.max_evaluations * int(poses.size());
    problem.step_tolerance = kTolerance;
    problem.function = [&](const Eigen::VectorXd& x) { return cost(moved(poses, root * x)); };
    const MinimisationResult result = optimizer_.minimise(problem);
    const std::vector<RigidTransform> best = moved(poses, root * result.x);
    for (std::size_t b = 0; b < poses.size(); ++b) {
      const Eigen::MatrixXd of_bone = root.middleRows<6>(6 * Eigen::Index(b));
      poses[b].world_from_model = best[b];
      poses[b].covariance = Matrix6d(of_bone * of_bone.transpose());
      poses[b].cost = among(b, level, best)->value(best[b]);
      poses[b].evaluations += result.evaluations;
    }
  }

  const List<Pose>& starts_;
  const Optimizer& optimizer_;
  const Options& options_;
  const search::SearchOptions search_options_;
  Context& context_;
  std::vector<search::Levels> levels_;  ///< of each bone's cost
  std::vector<RigidTransform> at_;
  std::vector<int> evaluations_;
};

List<Pose> checked(const List<Cost>& costs, const List<Pose>& starts, const List<Mesh>* models, Context& context) {
  if (starts.empty()) throw Error("there is no bone; wire the start of at least one");
  if (costs.names() != starts.names())
    throw Error("costs and starts are not of the same bones; wire both from nodes that are called for each fragment");
  List<Pose> with_axes;
  for (std::size_t b = 0; b < starts.size(); ++b) {
    check_pose(starts[b], "the start of '" + starts.name(b) + "'");
    const Mesh* model = models ? models->find(starts.name(b)) : nullptr;
    with_axes.add(starts.name(b), geometry::with_fragment_axes(starts[b], model, context));
  }
  return with_axes;
}

Result register_together(const List<Cost>& costs, const Optimizer& optimizer, const List<Pose>& starts,
                         const List<Mesh>* models, const Options& options, Context& context) {
  const List<Pose> initial = checked(costs, starts, models, context);
  const std::vector<Pose> found = Together(costs, initial, optimizer, options, context).run();
  Result result;
  for (std::size_t b = 0; b < found.size(); ++b) result.poses.add(initial.name(b), found[b]);
  result.pose = found.front();
  result.stages.add("start", initial[0]);
  result.stages.add("final", found.front());
  return result;
}

}  // namespace

MARROW_PLUGIN(plugin) {
  plugin.node("register.together", register_together)
      .summary(
          "Registration of several bones in the same images: each among the others in turn, then all at once. Their "
          "deviations count those of the others")
      .in("costs",
          "cost of each bone's pose; made with project.together or similarity.with_contact, it follows the other bones",
          over("fragment"))
      .in("optimizer", "minimiser")
      .in("starts", "pose of each bone to start from, such as that found by its own cost, and the bone's axes",
          over("fragment"))
      .in("models", "surfaces of the bones: they give the axes of starts that have none", over("fragment"))
      .out("poses", &Result::poses, "pose of each bone, with its predicted covariance", over("fragment"))
      .out("pose", &Result::pose, "that of the first bone")
      .out("stages", &Result::stages, "poses of the first bone: start, final", over("stage"))
      .option("contour_spacing_px", &Options::contour_spacing_px, "per level: distance between points of the outline",
              replaces({"contour_spacing_px", "ray_step"}))
      .option("reach_px", &Options::reach_px, "per level: distance beyond which a point counts as unmatched",
              replaces({"reach_px", "reach_mm"}))
      .option("pixel_step", &Options::pixel_step,
              "per level, for grey values: compare every n-th pixel; none: as the cost says",
              replaces({"costs.pixel_step"}))
      .option("step_deg", &Options::step_deg,
              "per level: first step of the rotations about the frontal and lateral axes")
      .option("step_axial_deg", &Options::step_axial_deg, "per level: first step of the axial rotation")
      .option("step_mm", &Options::step_mm, "per level: first step of the translations")
      .relation(same_length({"contour_spacing_px", "reach_px", "step_deg", "step_axial_deg", "step_mm"}))
      .relation(as_many_or_none("pixel_step", "contour_spacing_px"))
      .option("step_tolerance", &Options::step_tolerance, "a level ends when steps fall below this part of the first",
              at_least(1e-6), at_most(1))
      .option("max_evaluations", &Options::max_evaluations, "largest number of evaluations of a bone's cost per search",
              at_least(1))
      .option("max_rounds", &Options::max_rounds, "per level: how often the bones are refined in turn, at most",
              at_least(1))
      .option("warn_above_deg", &Options::warn_above_deg,
              "predicted standard deviation of a rotation that gives a warning", at_least(0))
      .option("warn_above_mm", &Options::warn_above_mm,
              "predicted standard deviation of a translation that gives a warning", at_least(0));
}
