// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <numeric>

#include "marrow/initial/free_scan.hpp"
#include "marrow/toolbox/match/inputs.hpp"
#include "marrow/toolbox/search/search.hpp"

namespace {

using namespace marrow;

struct Options {
  double rotation_side_deg = 20;
  double rotation_axial_deg = 40;
  double translation_side_mm = 40;
  double translation_axial_mm = 40;
  int poses = 4000;
  int candidates = 60;
  int finalists = 8;
  std::vector<double> contour_spacing_px{12, 6, 3};
  std::vector<double> reach_px{60, 24, 9};
  std::vector<double> pixel_step{16, 8, 4};
  int max_evaluations = 400;
  bool needs_start = false;
};

/// The search of register.multiresolution, started from poses all over the ranges. The first step of each level is
/// proportional to its reach.
search::SearchOptions search_options(const Options& options) {
  search::SearchOptions search;
  search.scan_poses = options.poses;
  search.scan_side_deg = options.rotation_side_deg;
  search.scan_rotation_deg = options.rotation_axial_deg;
  search.scan_side_mm = options.translation_side_mm;
  search.scan_translation_mm = options.translation_axial_mm;
  search.scan_reach = 0.25;
  search.candidates = options.candidates;
  search.finalists = options.finalists;
  search.contour_spacing_px = options.contour_spacing_px;
  search.reach_px = options.reach_px;
  search.pixel_step = options.pixel_step;
  search.max_evaluations = options.max_evaluations;
  search.step_deg.clear(), search.step_axial_deg.clear(), search.step_mm.clear();
  for (const double reach_px : options.reach_px) {
    search.step_deg.push_back(reach_px / 8);
    search.step_axial_deg.push_back(reach_px / 4);
    search.step_mm.push_back(reach_px / 8);
  }
  search.step_tolerance.assign(options.reach_px.size(), 0.1);
  return search;
}

/// What shows the bone in the images, for a search without a start.
struct Images {
  const OutlineProjector* projector;
  const List<View>* views;
  const List<EdgeMap>* edges;

  bool are_there() const { return projector || views || edges; }
  void check() const {
    if (!projector || !views || !edges)
      throw Error(std::string("a search without a start needs projector, views and edges, but nothing is wired to ") +
                  (!projector ? "projector"
                   : !views   ? "views"
                              : "edges") +
                  "; wire it, or give a start");
    match::check_views(*views);
    match::check_edges(*views, *edges);
  }
};

/// Two poses that a registration may well lead to the same end are neighbours.
struct Neighbourhood {
  Eigen::Vector3d model_middle_mm;
  double reach_mm;

  bool near(const RigidTransform& a, const RigidTransform& b) const {
    return (a * model_middle_mm - b * model_middle_mm).norm() < reach_mm &&
           geodesic_angle_rad(a.rotation, b.rotation) < radians(8);
  }
};

/// The poses, that of the least cost first.
std::vector<RigidTransform> in_order_of(const Cost& cost, const std::vector<RigidTransform>& poses) {
  const std::vector<double> values = cost.values(poses);
  std::vector<std::size_t> order(poses.size());
  std::iota(order.begin(), order.end(), std::size_t(0));
  std::stable_sort(order.begin(), order.end(), [&](std::size_t a, std::size_t b) { return values[a] < values[b]; });
  std::vector<RigidTransform> sorted;
  for (const std::size_t i : order) sorted.push_back(poses[i]);
  return sorted;
}

/// Poses that are not neighbours, in turns the next one by evidence and by cost. Evidence alone prefers long outlines,
/// of which half lie on an edge; a mean distance prefers those of which little is in view.
std::vector<RigidTransform> finalists_of(const std::vector<RigidTransform>& poses, const initial::Evidence& evidence,
                                         const Cost& cost, const Neighbourhood& neighbourhood, std::size_t count) {
  const std::vector<RigidTransform> orders[] = {evidence.best(poses, poses.size()), in_order_of(cost, poses)};
  std::vector<RigidTransform> chosen;
  for (std::size_t i = 0; i < poses.size(); ++i)
    for (const auto& order : orders) {
      const bool is_new = std::none_of(chosen.begin(), chosen.end(),
                                       [&](const auto& other) { return neighbourhood.near(order[i], other); });
      if (is_new && chosen.size() < count) chosen.push_back(order[i]);
    }
  return chosen;
}

/// Of the poses with nearly as much evidence as any, that of the least cost. Cost alone prefers those of which little
/// is in view, or that are so far away that their outline is short.
RigidTransform best_of(const std::vector<RigidTransform>& poses, const initial::Evidence& evidence, const Cost& cost) {
  constexpr double kNearly = 0.9;
  const std::vector<RigidTransform> sorted = evidence.best(poses, poses.size());
  const double most = evidence.of(sorted.front());
  std::vector<RigidTransform> good;
  for (const RigidTransform& pose : sorted)
    if (evidence.of(pose) >= std::min(most, kNearly * most)) good.push_back(pose);
  return in_order_of(cost, good).front();
}

/// The best pose of all orientations at all places that the views show. The best of a scan are moved to more evidence,
/// then refined by the cost through all levels.
RigidTransform anywhere(const Mesh& model, const Images& images, const FragmentFrame& frame,
                        const search::Levels& levels, const Options& options, search::Search& search,
                        Context& context) {
  constexpr std::size_t kScanned = 16;  // poses of the scan for each candidate; the scan orders poses only roughly
  images.check();
  const initial::Seen seen{model, *images.projector, *images.views, *images.edges};
  const auto candidates = std::size_t(options.candidates);
  const auto [scanned, middle_mm, cell_mm] =
      initial::free_scan(seen, frame, options.poses, kScanned * candidates, context);
  const initial::Evidence coarse(seen, middle_mm, cell_mm);
  std::vector<RigidTransform> poses = scanned;
  double step = 1;
  for (const std::size_t kept : {4 * candidates, 2 * candidates, candidates}) {
    coarse.climb(poses, frame.origin_mm, 8 * step, 2 * cell_mm * step);
    poses = coarse.best(poses, kept);
    step /= 2;
  }
  double done = 0;
  const auto refine = [&](std::size_t level, double share_of_all) {
    const double share = share_of_all / double(poses.size());
    for (RigidTransform& pose : poses) {
      search.go_to(pose);
      search.refine(*levels[level], search::kAllAxes, search.steps_of(level), done, share);
      pose = search.pose();
      done += share;
    }
  };
  refine(0, 0.6);
  poses = finalists_of(poses, {seen, middle_mm, cell_mm / 2}, *levels.front(), {frame.origin_mm, 3 * cell_mm},
                       std::size_t(options.finalists));
  for (std::size_t level = 1; level < levels.size(); ++level) refine(level, 0.4 / double(levels.size() - 1));
  return best_of(poses, coarse, *levels.back());
}

Pose global_search(const Mesh& model, const Cost& cost, const Optimizer& optimizer, const Pose* start,
                   const OutlineProjector* projector, const List<View>* views, const List<EdgeMap>* edges,
                   const Options& options, Context& context) {
  if (options.poses == 0)
    throw Error("it has no poses to try; give their number, such as 4000, and the ranges to search");
  if (!start && options.needs_start)
    throw Error(
        "there is no start to search around; give the approximate placement of the fragment, in case.yaml under "
        "'start' (docs/case.md)");
  check_mesh(model, "model");
  const search::SearchOptions settings = search_options(options);
  search::check_options(settings);
  const Images images{projector, views, edges};
  Pose middle;
  middle.world_from_model = start ? start->world_from_model : RigidTransform{"world", model.frame};
  check_pose(middle, "start");
  middle.frame = fragment_frame(model);
  const search::Levels levels = levels_of(cost, settings);
  search::Search search(optimizer, middle, settings, context);
  if (!start && images.are_there()) {
    search.go_to(anywhere(model, images, middle.frame, levels, options, search, context));
  } else {
    if (!start)
      context.info(
          "there is no start, so the search is around the place at which CT coordinates are world coordinates");
    search.go_to(search.find(levels).pose);
  }
  search::check_compared(*levels.back(), search.pose(), middle.frame);
  return pose_of(search, middle, *levels.back());
}

}  // namespace

MARROW_PLUGIN(plugin) {
  plugin.node("initial.global_search", global_search)
      .summary(
          "The pose of least cost within wide ranges, or in any orientation anywhere in view, searched from many poses "
          "at once; no start is needed")
      .in("model", "surface of the fragment")
      .in("cost", "cost of a pose")
      .in("optimizer", "minimiser that refines the best poses")
      .in("start",
          "middle of the ranges; none: any orientation is searched, anywhere that all views show; without projector, "
          "views and edges: CT coordinates are taken as world coordinates")
      .in("projector", "outline of the model, for a search without a start")
      .in("views", "X-ray views, for the same", over("view"))
      .in("edges", "edge pixels of each view, for the same", over("view"))
      .out("pose", "pose of least cost")
      .option("rotation_side_deg", &Options::rotation_side_deg,
              "range of the rotations about the frontal and lateral axes, to either side", at_least(0), at_most(180))
      .option("rotation_axial_deg", &Options::rotation_axial_deg,
              "range of the rotation about the long axis, to either side", at_least(0), at_most(180))
      .option("translation_side_mm", &Options::translation_side_mm,
              "range of the shifts along the frontal and lateral axes, to either side", at_least(0))
      .option("translation_axial_mm", &Options::translation_axial_mm,
              "range of the shift along the long axis, to either side", at_least(0))
      .option("poses", &Options::poses,
              "number of poses to try, spread evenly over these ranges; without a start, of orientations to try, "
              "spread evenly over all; 0: the node fails, for pipelines with other ways to a start",
              at_least(0))
      .option("candidates", &Options::candidates, "number of best poses to refine; no two of them are neighbours",
              at_least(1))
      .option("finalists", &Options::finalists,
              "number of best candidates after the first level that go through all levels; the last level chooses",
              at_least(1))
      .option("contour_spacing_px", &Options::contour_spacing_px,
              "per level: distance between two points of the outline", replaces({"contour_spacing_px", "ray_step"}))
      .option("reach_px", &Options::reach_px,
              "per level: a point with no edge within this distance counts as unmatched",
              replaces({"reach_px", "reach_mm"}))
      .relation(same_length({"contour_spacing_px", "reach_px"}))
      .option("pixel_step", &Options::pixel_step,
              "per level, for costs of grey values: only every n-th pixel is compared", replaces({"pixel_step"}))
      .relation(as_many_or_none("pixel_step", "contour_spacing_px"))
      .option("max_evaluations", &Options::max_evaluations,
              "largest number of evaluations of the cost for each search of a level", at_least(1))
      .option("needs_start", &Options::needs_start, "fail if there is no start, for pipelines with other ways to one");
}
