// SPDX-License-Identifier: Apache-2.0
#include "marrow/toolbox/geometry/fragments.hpp"
#include "marrow/toolbox/search/search.hpp"

namespace {

using marrow::search::Search;

struct Options : marrow::search::SearchOptions {
  std::vector<double> finer_pixel_step{4, 2};
  std::vector<double> finer_step_deg{1, 0.3};
  std::vector<double> finer_step_axial_deg{2, 0.6};
  std::vector<double> finer_step_mm{1, 0.3};
  std::vector<double> finer_step_tolerance{0.1, 0.03};
  double max_apart_deg = 5;
  double max_apart_mm = 3;
};

struct Result {
  marrow::Pose pose;
  marrow::List<marrow::Pose> stages;
};

void check_finer(const Options& options) {
  for (const auto& [values, name] :
       {std::pair(&options.finer_pixel_step, "finer_pixel_step"), std::pair(&options.finer_step_deg, "finer_step_deg"),
        std::pair(&options.finer_step_axial_deg, "finer_step_axial_deg"),
        std::pair(&options.finer_step_mm, "finer_step_mm"),
        std::pair(&options.finer_step_tolerance, "finer_step_tolerance")})
    marrow::search::check_level_list(*values, name);
}

/// The pose to which the first cost leads from the result of the second. So whether they agree depends on this result
/// alone: the first search may have gone elsewhere only because of where it began.
marrow::Pose led_back(const marrow::Pose& result, const marrow::Cost& cost, const marrow::Optimizer& optimizer,
                      const Options& options, marrow::Context& context) {
  Search search(optimizer, result, options, context);
  for (const std::size_t level : {std::size_t(0), options.step_deg.size() - 1})
    search.refine(cost, marrow::search::kAllAxes, search.steps_of(level), 1, 0);
  marrow::Pose pose = result;
  pose.world_from_model = search.pose();
  return pose;
}

/// A warning if the results of both costs are far apart, because then one of them is wrong. Empty if they agree.
std::string disagreement(const marrow::Pose& first, const marrow::Pose& second, const Options& options) {
  const marrow::Vector6d motion = motion_between(first.world_from_model, second.world_from_model, first.frame);
  const double apart_deg = marrow::degrees(motion.head<3>().norm()), apart_mm = motion.tail<3>().norm();
  if (apart_deg <= options.max_apart_deg && apart_mm <= options.max_apart_mm) return "";
  return marrow::formatted(
      "the two costs lead to poses {:.3g} degrees and {:.3g} mm apart: one of them is wrong; look at the overlays of "
      "both",
      apart_deg, apart_mm);
}

/// The second search, from the result of the first one.
marrow::Pose refined(const marrow::Pose& first, const marrow::Cost& finer_cost, const marrow::Optimizer& optimizer,
                     const Options& options, marrow::Context& context) {
  Search search(optimizer, first, options, context);
  std::shared_ptr<const marrow::Cost> level;
  const double share = 1.0 / double(options.finer_pixel_step.size());
  marrow::search::Steps steps;
  for (std::size_t i = 0; i < options.finer_pixel_step.size(); ++i) {
    steps = {options.finer_step_deg.at(i), options.finer_step_axial_deg.at(i), options.finer_step_mm.at(i),
             options.finer_step_tolerance.at(i)};
    level = finer_cost.at_level(
        {options.contour_spacing_px.back(), options.reach_px.back(), int(options.finer_pixel_step[i])});
    search.refine(*level, marrow::search::kAllAxes, steps, double(i) * share, share);
  }
  const auto coarser = finer_cost.at_level({options.contour_spacing_px.back(), options.reach_px.back(),
                                            marrow::search::coarser_pixel_step(options.finer_pixel_step.back())});
  marrow::Pose pose = final_pose_of(search, first, *level, steps, options, context, coarser.get());
  pose.evaluations += first.evaluations;
  return pose;
}

Result sequence(const marrow::Cost& cost, const marrow::Cost* finer_cost, const marrow::Optimizer& optimizer,
                const marrow::Optimizer* finer_optimizer, const marrow::Pose& start, const marrow::Mesh* model,
                const Options& options, marrow::Context& context) {
  marrow::search::check_options(options);
  check_finer(options);
  marrow::check_pose(start, "the pose to start from");
  const marrow::Pose initial = marrow::geometry::with_fragment_axes(start, model, context);
  const marrow::search::Levels levels = marrow::search::levels_of(cost, options);
  Search coarse(optimizer, initial, options, context);
  Result result;
  result.stages.add("start", pose_of(coarse, initial, *levels.back()));
  coarse.go_to(coarse.find(levels).pose);
  const marrow::Pose first =
      final_pose_of(coarse, initial, *levels.back(), coarse.steps_of(levels.size() - 1), options, context);
  result.stages.add("first", first);
  if (!finer_cost) context.info("there is no finer_cost, so the first search ends the registration");
  result.pose = finer_cost
                    ? refined(first, *finer_cost, finer_optimizer ? *finer_optimizer : optimizer, options, context)
                    : first;
  if (!disagreement(first, result.pose, options).empty()) {
    const marrow::Pose back = led_back(result.pose, *levels.back(), optimizer, options, context);
    if (const std::string warning = disagreement(back, result.pose, options); !warning.empty()) {
      context.warn(warning);
      result.pose.warnings.push_back(warning);
    }
  }
  result.stages.add("final", result.pose);
  return result;
}

}  // namespace

MARROW_PLUGIN(plugin) {
  auto node = plugin.node("register.sequence", sequence);
  node.summary(
          "Registration by two costs: first one cost from coarse to fine, then another from its result (for example "
          "contour, then grey values)")
      .in("cost", "cost of a pose for the first search")
      .in("finer_cost",
          "cost of a pose for a second search, near the result of the first; if there is none, as without a CT, the "
          "first search ends it")
      .in("optimizer", "minimiser")
      .in("finer_optimizer", "minimiser of finer_cost; none: the same as for cost")
      .in("start", "pose to start from, and the fragment's axes")
      .in("model", "surface of the fragment: it gives the axes of a start that has none")
      .out("pose", &Result::pose,
           "pose with the least finer_cost, near the pose with the least cost; with its predicted covariance")
      .out("stages", &Result::stages, "poses of the search: start, first, final", marrow::over("stage"));
  marrow::search::declare<Options>(node);
  node.option("finer_pixel_step", &Options::finer_pixel_step,
              "per level of finer_cost: only every n-th pixel is compared", marrow::replaces({"finer_cost.pixel_step"}))
      .option("finer_step_deg", &Options::finer_step_deg,
              "per level of finer_cost: first step of the rotations about the frontal and lateral axes")
      .option("finer_step_axial_deg", &Options::finer_step_axial_deg,
              "per level of finer_cost: first step of the axial rotation")
      .option("finer_step_mm", &Options::finer_step_mm, "per level of finer_cost: first step of the translations")
      .option("finer_step_tolerance", &Options::finer_step_tolerance,
              "per level of finer_cost: the level ends when steps are shorter than this fraction of its first step")
      .relation(marrow::same_length(
          {"finer_pixel_step", "finer_step_deg", "finer_step_axial_deg", "finer_step_mm", "finer_step_tolerance"}))
      .option("max_apart_deg", &Options::max_apart_deg,
              "a larger rotation between the results of the two costs gives a warning", marrow::at_least(0))
      .option("max_apart_mm", &Options::max_apart_mm,
              "a larger shift between the results of the two costs gives a warning", marrow::at_least(0));
}
