// SPDX-License-Identifier: Apache-2.0
// The mirror pose of a nearly symmetric part. In one view, the outline hardly changes if space is reflected at the
// plane across the line of sight, and the outline of a part with a plane of symmetry is that of its own reflection.
// Both together are a rotation: R' = (I - 2 d d^T) R (I - 2 n n^T), with the line of sight d and the plane's normal n.
// It turns the sign of the angles out of the image's plane, about the part's middle, which stays where it is.
#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <limits>

#include "marrow/domain/decompositions.hpp"
#include "marrow/toolbox/search/search.hpp"

namespace {

using namespace marrow;
using Eigen::Matrix3d, Eigen::Vector3d;

struct Options {
  double scan_deg = 6;
  double scan_mm = 6;
  int poses = 150;
  double least_apart_deg = 5;
};

struct Result {
  Pose pose;
  Metrics metrics;
};

/// A plane through the middle of a surface, and how little the surface's reflection in it is like the surface.
struct Symmetry {
  Vector3d middle_mm, normal;
  double rest_mm = 0;  ///< mean distance of the reflection from the surface
};

/// The planes across the three axes of inertia: a plane of symmetry is one of them.
std::array<Symmetry, 3> symmetries_of(const Mesh& mesh) {
  const std::vector<Vector3d> points = sample_surface(mesh, 1500);
  Vector3d middle = Vector3d::Zero();
  for (const Vector3d& point : points) middle += point / double(points.size());
  Matrix3d spread = Matrix3d::Zero();
  for (const Vector3d& point : points) spread += (point - middle) * (point - middle).transpose();
  const auto axes = eigen_of_symmetric<3>(spread).vectors;
  std::array<Symmetry, 3> planes;
  for (int k = 0; k < 3; ++k) {
    const Vector3d normal = axes.col(k);
    double sum = 0;
    int count = 0;
    for (std::size_t i = 0; i < points.size(); i += 3, ++count) {
      const Vector3d reflected = points[i] - 2 * normal * normal.dot(points[i] - middle);
      double nearest = std::numeric_limits<double>::max();
      for (const Vector3d& point : points) nearest = std::min(nearest, (point - reflected).squaredNorm());
      sum += std::sqrt(nearest);
    }
    planes[std::size_t(k)] = {middle, normal, sum / count};
  }
  return planes;
}

/// The mirror pose in a view.
RigidTransform mirrored(const RigidTransform& pose, const Symmetry& symmetry, const Camera& camera) {
  const Vector3d middle = pose * symmetry.middle_mm, d = (middle - source_position_mm(camera)).normalized(),
                 n = symmetry.normal;
  RigidTransform mirror = pose;
  mirror.rotation =
      (Matrix3d::Identity() - 2 * d * d.transpose()) * pose.rotation * (Matrix3d::Identity() - 2 * n * n.transpose());
  mirror.translation_mm = middle - mirror.rotation * symmetry.middle_mm;
  return mirror;
}

double apart_deg(const Pose& one, const Pose& other) {
  return degrees(geodesic_angle_rad(one.world_from_model.rotation, other.world_from_model.rotation));
}

search::SearchOptions settings(const Options& options) {
  search::SearchOptions search;
  search.scan_poses = options.poses;
  search.scan_rotation_deg = search.scan_side_deg = options.scan_deg;
  search.scan_translation_mm = search.scan_side_mm = options.scan_mm;
  search.candidates = 6, search.finalists = 2;
  return search;
}

Result mirror_pose(const Pose& pose, const Cost& cost, const Optimizer& optimizer, const Mesh& model,
                   const List<View>& views, const Options& options, Context& context) {
  check_pose(pose, "pose");
  check_mesh(model, "model");
  if (views.empty()) throw Error("evaluate.mirror_pose: there are no views");
  const search::SearchOptions search_options = settings(options);
  const search::Levels levels = search::levels_of(cost, search_options);
  Pose own = pose;
  own.frame = fragment_frame(model);
  own.covariance.reset(), own.warnings.clear(), own.convergence.clear();
  own.cost = levels.back()->value(pose.world_from_model);
  Result result{own, {}};
  double rest_mm = 0;
  bool is_found = false;
  for (const Symmetry& symmetry : symmetries_of(model))
    for (const View& view : views) {
      Pose start = own;
      start.world_from_model = mirrored(pose.world_from_model, symmetry, view.camera);
      if (apart_deg(start, own) < options.least_apart_deg) continue;  // seen along the plane: they are the same
      search::Search search(optimizer, start, search_options, context);
      search.go_to(search.find(levels).pose);
      const Pose found = pose_of(search, start, *levels.back());
      if (apart_deg(found, own) < options.least_apart_deg || (is_found && found.cost >= result.pose.cost)) continue;
      result.pose = found, rest_mm = symmetry.rest_mm, is_found = true;
    }
  const double apart = apart_deg(result.pose, own);
  result.metrics.items = {{"cost", own.cost, ""},
                          {"mirror_cost", result.pose.cost, ""},
                          {"mirror_times", own.cost > 0 ? result.pose.cost / own.cost : 1e3, ""},
                          {"mirror_apart_deg", apart, "deg"},
                          {"asymmetry_mm", rest_mm, "mm"}};
  if (!is_found) {
    context.info("the part is seen along its planes of symmetry, so it has no mirror pose in these views");
    return result;
  }
  context.info(
      formatted("the mirror pose is {:.1f} degrees away; its cost is {:.4g}, that of the pose {:.4g}; the part differs "
                "from its reflection by {:.2f} mm",
                apart, result.pose.cost, own.cost, rest_mm));
  return result;
}

}  // namespace

MARROW_PLUGIN(plugin) {
  plugin.node("evaluate.mirror_pose", mirror_pose)
      .summary(
          "The mirror pose of a nearly symmetric part, such as a tibial tray: the other pose whose outline is nearly "
          "the same in one view; it is searched for, and both costs are given")
      .in("pose", "pose found")
      .in("cost", "cost of a pose")
      .in("optimizer", "minimiser that refines the mirror pose")
      .in("model", "surface of the part; the planes across its axes of inertia are tried")
      .in("views", "the views; the mirror pose of each is tried", over("view"))
      .out("pose", &Result::pose, "the mirror pose, refined; the pose itself where the two are the same")
      .out("metrics", &Result::metrics,
           "costs of both poses and their ratio; the angle between them; how far the part differs from its reflection")
      .figures({"cost", "mirror_cost", "mirror_times", "mirror_apart_deg", "asymmetry_mm"})
      .option("scan_deg", &Options::scan_deg, "range of the rotations tried around the mirror pose, to either side",
              at_least(0), at_most(90))
      .option("scan_mm", &Options::scan_mm, "the same for the shifts", at_least(0))
      .option("poses", &Options::poses, "number of poses tried in these ranges", at_least(1))
      .option("least_apart_deg", &Options::least_apart_deg,
              "a search that ends nearer to the pose than this has come back to it, and is no mirror pose", at_least(0),
              at_most(180));
}
