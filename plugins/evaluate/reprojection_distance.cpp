// SPDX-License-Identifier: Apache-2.0
// mRPD of van de Kraats et al., Standardized evaluation methodology for 2-D-3-D registration, IEEE TMI 24, 2005: a
// target is projected at the found pose; its error is the distance in the patient between the ray through this pixel
// and the target's true position.
#include <Eigen/Geometry>
#include <cmath>
#include <marrow/plugin.hpp>

#include "marrow/toolbox/geometry/targets.hpp"

namespace {

using namespace marrow;

struct Options {
  int points = 500;
};

std::vector<double> distances_mm(const View& view, const RigidTransform& pose, const RigidTransform& truth,
                                 const std::vector<Eigen::Vector3d>& targets_mm) {
  check_camera(view.camera, "view '" + view.name + "'");
  const Eigen::Vector3d source = source_position_mm(view.camera);
  std::vector<double> distances;
  for (const Eigen::Vector3d& target : targets_mm) {
    const Eigen::Vector2d pixel = project(view.camera, pose * target);
    if (!pixel.allFinite())
      throw Error("view '" + view.name + "': a target does not lie in front of the X-ray source at the pose found");
    distances.push_back((truth * target - source).cross(ray_direction(view.camera, pixel)).norm());
  }
  return distances;
}

void add_mean(const std::string& prefix, const std::vector<double>& distances_mm, Metrics& metrics) {
  metrics.items.push_back({prefix + "mrpd_mm", geometry::mean(distances_mm), "mm"});
}

Metrics reprojection_distance(const Pose& pose, const Truth& truth, const Mesh* model, const Landmarks* landmarks,
                              const List<View>& views, const Options& options) {
  geometry::check_poses(pose.world_from_model, truth.world_from_model);
  if (views.empty()) throw Error("there is no view to project into; wire the views that the pose was found in");
  const std::vector<Eigen::Vector3d> targets =
      geometry::targets_mm(pose.world_from_model, model, landmarks, options.points);
  Metrics metrics;
  std::vector<double> all;
  for (std::size_t i = 0; i < views.size(); ++i) {
    const std::vector<double> distances =
        distances_mm(views[i], pose.world_from_model, truth.world_from_model, targets);
    add_mean(views.name(i) + "_", distances, metrics);
    all.insert(all.end(), distances.begin(), distances.end());
  }
  add_mean("", all, metrics);
  return metrics;
}

}  // namespace

MARROW_PLUGIN(plugin) {
  plugin.node("evaluate.reprojection_distance", reprojection_distance)
      .summary(
          "Mean reprojection distance (mRPD) between the true targets and the rays through their projections at the "
          "found pose")
      .in("pose", "pose found")
      .in("truth", "exact pose")
      .in("model", "surface of the fragment; the targets are spread over it")
      .in("landmarks", "landmarks to use as targets instead")
      .relation(at_least_one({"in.model", "in.landmarks"}))
      .in("views", "X-ray views; only their cameras are used", over("view"))
      .out("metrics", "mRPD for all views together and for each view; an error along the beam of a view does not count")
      .figures({"mrpd_mm", "*_mrpd_mm"})
      .option("points", &Options::points, "number of targets spread over the surface", at_least(1), at_most(1e6));
}
