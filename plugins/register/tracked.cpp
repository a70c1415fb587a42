// SPDX-License-Identifier: Apache-2.0
// Registration of one frame of a sequence. The prediction is a good start, so the search is short. If what it finds
// does not agree with the prediction, or costs more than usual, poses all around it are tried, as far away as its
// deviations say.
#include <algorithm>
#include <cmath>
#include <marrow/domain/decompositions.hpp>

#include "marrow/toolbox/geometry/fragments.hpp"
#include "marrow/toolbox/search/search.hpp"
#include "marrow/toolbox/track/motion_model.hpp"

namespace {

using namespace marrow;
using search::Search;

struct Options {
  std::vector<double> contour_spacing_px{4, 2};
  std::vector<double> reach_px{16, 6};
  std::vector<double> finer_pixel_step{4, 2};
  std::vector<double> step_deg{0.5, 0.15};
  std::vector<double> step_axial_deg{1, 0.3};
  std::vector<double> step_mm{0.5, 0.15};
  double step_tolerance = 0.03;
  int max_evaluations = 200;
  double gate = 22.46;
  int wide_poses = 500;
  double max_wide_deg = 20;
  double max_wide_mm = 30;
  int covariance_every = 10;
};

struct Result {
  Pose pose;
  List<Pose> stages;
};

constexpr double kDeviations = 3;  // how far the wider search goes

search::SearchOptions search_options(const Options& options, const Pose& predicted) {
  search::SearchOptions result;
  result.contour_spacing_px = options.contour_spacing_px;
  result.reach_px = options.reach_px;
  result.step_deg = options.step_deg;
  result.step_axial_deg = options.step_axial_deg;
  result.step_mm = options.step_mm;
  result.step_tolerance.assign(options.contour_spacing_px.size(), options.step_tolerance);
  result.max_evaluations = options.max_evaluations;
  result.scan_poses = options.wide_poses;
  result.candidates = 8;
  result.finalists = 2;
  const auto range = [&](int a, int b) {
    const Matrix6d& covariance = *predicted.covariance;
    return kDeviations * std::sqrt(std::max(covariance(a, a), covariance(b, b)));
  };
  result.scan_side_deg = std::min(options.max_wide_deg, degrees(range(0, 1)));
  result.scan_rotation_deg = std::min(options.max_wide_deg, degrees(range(2, 2)));
  result.scan_side_mm = std::min(options.max_wide_mm, range(3, 4));
  result.scan_translation_mm = std::min(options.max_wide_mm, range(5, 5));
  return result;
}

/// For a start of unknown accuracy: as far as the wider search goes.
Matrix6d unknown_covariance(const Options& options) {
  Vector6d deviation;
  deviation << Eigen::Vector3d::Constant(radians(options.max_wide_deg) / kDeviations),
      Eigen::Vector3d::Constant(options.max_wide_mm / kDeviations);
  return deviation.cwiseAbs2().asDiagonal();
}

class Frame {
 public:
  Frame(const Cost& cost, const Cost* finer_cost, const Optimizer& optimizer, const Optimizer* finer_optimizer,
        const Pose& predicted, const std::optional<Matrix6d>& covariance, const Options& options, Context& context)
      : finer_cost_(finer_cost),
        optimizer_(optimizer),
        finer_optimizer_(finer_optimizer ? *finer_optimizer : optimizer),
        predicted_(predicted),
        covariance_(covariance),
        options_(options),
        search_options_(search_options(options, predicted)),
        context_(context),
        levels_(search::levels_of(cost, search_options_)) {}

  /// The minimum near the prediction; nothing if the images say nothing about it.
  std::optional<Pose> near() {
    Search search(optimizer_, predicted_, search_options_, context_);
    for (std::size_t i = 0; i < levels_.size(); ++i)
      search.refine(*levels_[i], search::kAllAxes, search.steps_of(i), 0.1 * double(i), 0.1);
    return finished(search);
  }

  /// The best of the minima all around the prediction; nothing if the images say nothing about it.
  std::optional<Pose> wide() {
    Search search(optimizer_, predicted_, search_options_, context_);
    search.go_to(search.find(levels_).pose);
    return finished(search);
  }

  /// Why the last search led to nothing.
  const std::string& why_nothing() const { return why_nothing_; }

  bool agrees(const Pose& found) const {
    if (!found.covariance || !found.covariance->allFinite()) return false;
    const Vector6d motion = motion_between(predicted_.world_from_model, found.world_from_model, predicted_.frame);
    const Matrix6d sum = *predicted_.covariance + *found.covariance;
    return motion.dot(solve_symmetric<6>(sum, motion)) <= options_.gate;
  }

 private:
  /// The search's pose. A new covariance takes most of a frame's time.
  std::optional<Pose> with_covariance(Search& search, const Cost& cost, const search::Steps& steps) {
    why_nothing_ = search::nothing_compared(cost, search.pose(), predicted_.frame);
    if (!why_nothing_.empty()) return std::nullopt;
    if (!covariance_) return final_pose_of(search, predicted_, cost, steps, search_options_, context_);
    Pose pose = pose_of(search, predicted_, cost);
    pose.covariance = covariance_;
    search::warn_of_silent_views(cost, pose, context_);
    return pose;
  }

  std::optional<Pose> finished(Search& coarse) {
    const search::Steps last = coarse.steps_of(levels_.size() - 1);
    if (!finer_cost_) return with_covariance(coarse, *levels_.back(), last);
    Search search(finer_optimizer_, predicted_, search_options_, context_);
    search.go_to(coarse.pose());
    std::shared_ptr<const Cost> level;
    search::Steps steps = last;
    for (const double pixel_step : options_.finer_pixel_step) {
      level = finer_cost_->at_level({options_.contour_spacing_px.back(), options_.reach_px.back(), int(pixel_step)});
      search.refine(*level, search::kAllAxes, steps, 0.3, 0.5);
      steps.deg *= 0.3, steps.axial_deg *= 0.3, steps.mm *= 0.3;
    }
    return with_covariance(search, *level, steps);
  }

  const Cost* finer_cost_;
  const Optimizer& optimizer_;
  const Optimizer& finer_optimizer_;
  const Pose& predicted_;
  const std::optional<Matrix6d> covariance_;  ///< of an earlier frame, if it is reused for this one
  const Options& options_;
  search::SearchOptions search_options_;
  Context& context_;
  search::Levels levels_;
  std::string why_nothing_;
};

/// After some frames without the bone the prediction is so wide that a wrong pose agrees with it, too. Its cost reveals
/// it.
bool is_unusual(const Pose& found, const track::TrackState& state) {
  constexpr double kMostRatio = 1.5;
  return found.cost > kMostRatio * state.usual_cost;  // not if there is no usual cost yet: it is not a number
}

Result tracked(const Cost& cost, const Cost* finer_cost, const Optimizer& optimizer, const Optimizer* finer_optimizer,
               const Pose& start, const track::TrackState* state, const Mesh* model, const Options& options,
               Context& context) {
  check_pose(start, "the predicted pose");
  const Pose initial = geometry::with_fragment_axes(start, model, context);
  Pose predicted = initial;
  if (const std::string unknown = track::why_unknown(initial.covariance); !unknown.empty()) {
    if (initial.covariance) context.warn("the predicted pose counts as hardly known: " + unknown);
    predicted.covariance = unknown_covariance(options);
  }
  std::optional<Matrix6d> covariance;
  if (state && state->frame % options.covariance_every != 0) covariance = state->usual_covariance;
  if (covariance && !start.frame.is_anatomical) {
    const Matrix6d change = change_of_frame(state->fragment, initial.frame);
    covariance = change * *covariance * change.transpose();
  }
  Frame frame(cost, finer_cost, optimizer, finer_optimizer, predicted, covariance, options, context);
  Result result;
  result.stages.add("predicted", initial);
  std::optional<Pose> found = frame.near();
  if (!found || !frame.agrees(*found) || (state && is_unusual(*found, *state))) {
    if (found) result.stages.add("near", *found);
    const std::optional<Pose> wide = frame.wide();
    if (!found && !wide) search::refuse_pose(frame.why_nothing());
    if (!found || (wide && wide->cost < found->cost)) found = wide;
  }
  result.pose = *found;
  result.stages.add("final", result.pose);
  return result;
}

}  // namespace

MARROW_PLUGIN(plugin) {
  plugin.node("register.tracked", tracked)
      .summary(
          "Registration of a frame of a sequence from a predicted pose; a wider search only where the result does not "
          "agree with the prediction")
      .in("cost", "cost of a pose")
      .in("finer_cost", "cost for a second search, from the result of the first")
      .in("optimizer", "minimiser")
      .in("finer_optimizer", "minimiser of finer_cost; none: the same as for cost")
      .in("start",
          "predicted pose with its covariance, and the fragment's axes; without a covariance, or with one that says "
          "nothing, it counts as hardly known")
      .in("state", "state before the frame; if given, most frames reuse the covariance of an earlier frame")
      .in("model", "surface of the fragment: it gives the axes of a start that has none")
      .out("pose", &Result::pose, "pose of least cost, with its predicted covariance")
      .out("stages", &Result::stages, "poses of the search: predicted, near (if it was found but not enough), final",
           over("stage"))
      .option("contour_spacing_px", &Options::contour_spacing_px, "per level: distance between points of the outline",
              replaces({"contour_spacing_px", "ray_step"}))
      .option("reach_px", &Options::reach_px, "per level: distance beyond which a point counts as unmatched",
              replaces({"reach_px", "reach_mm"}))
      .option("step_deg", &Options::step_deg,
              "per level: first step of the rotations about the frontal and lateral axes")
      .option("step_axial_deg", &Options::step_axial_deg, "per level: first step of the axial rotation")
      .option("step_mm", &Options::step_mm, "per level: first step of the translations")
      .relation(same_length({"contour_spacing_px", "reach_px", "step_deg", "step_axial_deg", "step_mm"}))
      .option("finer_pixel_step", &Options::finer_pixel_step,
              "per level of finer_cost: only every n-th pixel is compared", replaces({"finer_cost.pixel_step"}))
      .option("step_tolerance", &Options::step_tolerance, "a level ends when steps fall below this part of the first",
              at_least(1e-6), at_most(1))
      .option("max_evaluations", &Options::max_evaluations, "largest number of evaluations of a cost per level",
              at_least(1))
      .option("gate", &Options::gate,
              "squared Mahalanobis distance from the prediction beyond which the search is widened (22.46: 99.9 % of "
              "right poses are nearer)",
              at_least(0), unit(""))
      .option("covariance_every", &Options::covariance_every,
              "with 'state': the covariance is computed again for every n-th frame", at_least(1))
      .option("wide_poses", &Options::wide_poses, "number of poses that the wider search tries", at_least(1))
      .option("max_wide_deg", &Options::max_wide_deg, "largest range of the wider search about each axis", at_least(0),
              at_most(180))
      .option("max_wide_mm", &Options::max_wide_mm, "largest range of the wider search along each axis", at_least(0));
}
