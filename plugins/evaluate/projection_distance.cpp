// SPDX-License-Identifier: Apache-2.0
// mPD of van de Kraats et al., Standardized evaluation methodology for 2-D-3-D registration, IEEE TMI 24, 2005: the
// mean distance between the projections of the targets at the found and at the true pose. An error along the beam
// hardly counts.
#include <cmath>
#include <marrow/plugin.hpp>

#include "marrow/toolbox/geometry/targets.hpp"

namespace {

using namespace marrow;

struct Options {
  int points = 500;
  std::vector<double> source_to_detector_mm;
};

struct Distances {
  std::vector<double> px, mm, detector_mm;
};

/// Distance in mm from the source to the detector of a view; 0 if not known. A camera matrix gives it only in pixels.
double source_to_detector_mm(const Options& options, std::size_t view, std::size_t views) {
  const std::vector<double>& given = options.source_to_detector_mm;
  if (given.empty()) return 0;
  if (given.size() != 1 && given.size() != views)
    throw Error(
        formatted("source_to_detector_mm has {} numbers, but there are {} views; give one for all, or one for each",
                  given.size(), views));
  const double distance = given[given.size() == 1 ? 0 : view];
  if (!(distance > 0))
    throw Error(formatted("source_to_detector_mm: each number must be positive, got {:f}", distance));
  return distance;
}

Distances distances_of(const View& view, const RigidTransform& pose, const RigidTransform& truth,
                       const std::vector<Eigen::Vector3d>& targets_mm, double detector_mm) {
  check_camera(view.camera, "view '" + view.name + "'");
  Distances distances;
  for (const Eigen::Vector3d& target : targets_mm) {
    const Eigen::Vector2d apart = project(view.camera, pose * target) - project(view.camera, truth * target);
    if (!apart.allFinite())
      throw Error("view '" + view.name + "': a target does not lie in front of the X-ray source" +
                  (project(view.camera, truth * target).allFinite()
                       ? " at the pose found"
                       : " at the true pose; is the truth in another world frame?"));
    distances.px.push_back(apart.norm());
    const double mm = offset_at_mm(view.camera, truth * target, apart).norm();
    distances.mm.push_back(mm);
    const double depth_mm = (view.camera.camera_from_world * (truth * target)).z();
    if (detector_mm > 0) distances.detector_mm.push_back(mm * detector_mm / depth_mm);
  }
  return distances;
}

void report(const std::string& prefix, const Distances& distances, Metrics& metrics) {
  metrics.items.push_back({prefix + "mpd_px", geometry::mean(distances.px), "px"});
  metrics.items.push_back({prefix + "mpd_mm", geometry::mean(distances.mm), "mm"});
  if (!distances.detector_mm.empty())
    metrics.items.push_back({prefix + "mpd_detector_mm", geometry::mean(distances.detector_mm), "mm"});
}

Metrics projection_distance(const Pose& pose, const Truth& truth, const Mesh* model, const Landmarks* landmarks,
                            const List<View>& views, const Options& options) {
  geometry::check_poses(pose.world_from_model, truth.world_from_model);
  if (views.empty()) throw Error("there is no view to project into; wire the views that the pose was found in");
  const std::vector<Eigen::Vector3d> targets =
      geometry::targets_mm(pose.world_from_model, model, landmarks, options.points);
  Distances all;
  Metrics each, metrics;
  for (std::size_t i = 0; i < views.size(); ++i) {
    const Distances one = distances_of(views[i], pose.world_from_model, truth.world_from_model, targets,
                                       source_to_detector_mm(options, i, views.size()));
    report(views.name(i) + "_", one, each);
    all.px.insert(all.px.end(), one.px.begin(), one.px.end());
    all.mm.insert(all.mm.end(), one.mm.begin(), one.mm.end());
    all.detector_mm.insert(all.detector_mm.end(), one.detector_mm.begin(), one.detector_mm.end());
  }
  report("", all, metrics);
  metrics.items.insert(metrics.items.end(), each.items.begin(), each.items.end());
  return metrics;
}

}  // namespace

MARROW_PLUGIN(plugin) {
  plugin.node("evaluate.projection_distance", projection_distance)
      .summary(
          "Mean projection distance (mPD) between the projections of the targets at the found and at the true pose")
      .in("pose", "pose found")
      .in("truth", "exact pose")
      .in("model", "surface of the fragment; the targets are spread over it")
      .in("landmarks", "landmarks to use as targets instead")
      .relation(at_least_one({"in.model", "in.landmarks"}))
      .in("views", "X-ray views; only their cameras are used", over("view"))
      .out("metrics",
           "for all views together and for each view: mPD in pixels, in mm at the target's depth (divided by the "
           "magnification) and, if source_to_detector_mm is given, in mm on the detector")
      .figures({"mpd_px", "mpd_mm", "mpd_detector_mm", "*_mpd_px", "*_mpd_mm", "*_mpd_detector_mm"})
      .option("points", &Options::points, "number of targets spread over the surface", at_least(1), at_most(1e6))
      .option("source_to_detector_mm", &Options::source_to_detector_mm,
              "distance from the source to the detector, one for all views or one for each view; empty: not known");
}
