// SPDX-License-Identifier: Apache-2.0
#include <algorithm>

#include "marrow/toolbox/geometry/fragments.hpp"
#include "marrow/toolbox/search/search.hpp"

namespace {

using marrow::Pose;

struct Options {
  double contour_spacing_px = 8;
  double reach_px = 24;
  int pixel_step = 0;
  int max_evaluations = 150;
};

/// A start, after a short search from it.
struct Way {
  std::string name;  ///< of the input
  Pose pose;
};

/// The first steps are those of the coarsest level of a registration with this reach.
Pose refined(const Pose& start, const marrow::Cost& cost, const marrow::Optimizer& optimizer, const Options& options,
             marrow::Context& context, double done, double share) {
  marrow::search::SearchOptions search_options;
  search_options.max_evaluations = options.max_evaluations;
  marrow::search::Search search(optimizer, start, search_options, context);
  const marrow::search::Steps steps{options.reach_px / 8, options.reach_px / 4, options.reach_px / 8, 0.1};
  search.refine(cost, marrow::search::kAllAxes, steps, done, share);
  return pose_of(search, start, cost);
}

/// "second is the best start, with a cost of 0.21; first 0.4, third 0.9".
std::string comparison_of(const std::vector<Way>& ways, const Way& best) {
  const auto cost_text = [](const Way& way) { return marrow::formatted("{:.6g}", way.pose.cost); };
  std::string text = best.name + " is the best start, with a cost of " + cost_text(best), separator = "; ";
  for (const Way& way : ways) {
    if (way.name == best.name) continue;
    text += separator + way.name + " " + cost_text(way);
    separator = ", ";
  }
  return text;
}

Pose best_of(const Pose* first, const Pose* second, const Pose* third, const Pose* fourth, const marrow::Mesh* model,
             const marrow::Cost& cost, const marrow::Optimizer& optimizer, const Options& options,
             marrow::Context& context) {
  std::vector<std::pair<std::string, const Pose*>> starts{
      {"first", first}, {"second", second}, {"third", third}, {"fourth", fourth}};
  std::erase_if(starts, [](const auto& start) { return !start.second; });
  if (starts.empty())
    throw marrow::Error(
        "no way led to a start: none of the inputs first, second, third and fourth is there; see why the nodes that "
        "they are wired to gave none");
  for (const auto& [name, start] : starts) marrow::check_pose(*start, name);
  const auto level = cost.at_level({options.contour_spacing_px, options.reach_px, options.pixel_step});
  std::vector<Way> ways;
  std::string silent;  // the starts about which the images say nothing, and why
  int evaluations = 0, tried = 0;
  const double share = 1.0 / double(starts.size());
  for (const auto& [name, start] : starts) {
    const double done = share * double(tried++);
    const Pose about_its_axes = marrow::geometry::with_fragment_axes(*start, model, context);
    const Pose pose = refined(about_its_axes, *level, optimizer, options, context, done, share);
    evaluations += pose.evaluations;
    const std::string why = marrow::search::nothing_compared(*level, pose.world_from_model, pose.frame);
    if (why.empty())
      ways.push_back({name, pose});
    else
      silent += (silent.empty() ? "" : "; ") + name + ": " + why;
  }
  if (ways.empty()) marrow::search::refuse_pose(silent, "any start");
  if (!silent.empty()) context.info("the images say nothing about a start: " + silent);
  // Of equal ones, the first.
  const auto best =
      std::min_element(ways.begin(), ways.end(), [](const Way& a, const Way& b) { return a.pose.cost < b.pose.cost; });
  context.info(comparison_of(ways, *best));
  Pose pose = best->pose;
  pose.evaluations = evaluations;
  return pose;
}

}  // namespace

MARROW_PLUGIN(plugin) {
  plugin.node("initial.best_of", best_of)
      .summary("The best of several starts: each is refined briefly, and the one with the least cost is taken")
      .in("first", "a start")
      .in("second", "another start")
      .in("third", "another start")
      .in("fourth", "another start; missing starts are left out, but at least one must be given")
      .in("model", "surface of the fragment: it gives the axes of a start that has none")
      .in("cost", "cost of a pose")
      .in("optimizer", "minimiser that refines each start")
      .out("pose", "the start of least cost, refined; of equal ones, the first")
      .option("contour_spacing_px", &Options::contour_spacing_px, "distance between two points of the outline",
              marrow::at_least(0.1), marrow::replaces({"contour_spacing_px", "ray_step"}))
      .option("reach_px", &Options::reach_px,
              "a point with no edge within this distance counts as unmatched; the first steps are proportional to it",
              marrow::at_least(0.1), marrow::replaces({"reach_px", "reach_mm"}))
      .option("pixel_step", &Options::pixel_step,
              "for costs of grey values: only every n-th pixel is compared; 0: as the cost says", marrow::at_least(0),
              marrow::replaces({"pixel_step"}))
      .option("max_evaluations", &Options::max_evaluations, "largest number of evaluations of the cost for each start",
              marrow::at_least(1));
}
