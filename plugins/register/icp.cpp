// SPDX-License-Identifier: Apache-2.0
// Iterative closest points (ICP): Besl and McKay, A method for registration of 3-D shapes, IEEE PAMI 14, 1992, in PCL's
// version. The target is a surface in the world, for example touched with a pointer or from another scan. Model and
// target need not show the same part of the bone.
#include <cmath>
#include <marrow/plugin.hpp>

#include <marrow/domain/decompositions.hpp>
#include "closest_points.hpp"

namespace {

using namespace marrow;

struct Options {
  int max_iterations = 200;
  double reach_mm = 10;
  int points = 2000;
  int target_points = 50000;
};

struct Result {
  Pose pose;
  List<Pose> stages;
};

void check_frames(const Pose& initial, const Mesh& model, const Mesh& target) {
  check_pose(initial, "the pose to start from");
  check_mesh(model, "model");
  check_mesh(target, "target");
  if (model.frame != initial.world_from_model.source)
    throw Error("the model is in the frame '" + model.frame + "', but the pose to start from takes points in '" +
                initial.world_from_model.source + "'; give the model of this start");
  if (target.frame != initial.world_from_model.target)
    throw Error("the target is in the frame '" + target.frame + "', but the pose to start from leads to '" +
                initial.world_from_model.target + "'; the target is a surface in the world");
}

std::string percent(std::size_t part, std::size_t whole) {
  return formatted("{:.0f} %", 100 * double(part) / double(whole));
}

void add_warnings(const marrow::closest_points::Result& found, const Options& options, Pose& pose,
                  const Context& context) {
  if (!found.converged)
    pose.warnings.push_back(formatted("the pairs of points still changed after {} iterations; raise max_iterations",
                                      options.max_iterations));
  if (found.paired < std::size_t(options.points) / 2)
    pose.warnings.push_back("only " + percent(found.paired, std::size_t(options.points)) +
                            " of the model's points have one of the target within reach_mm; is the start far off, or "
                            "the target another part?");
  for (const std::string& warning : pose.warnings) context.warn(warning);
}

Result icp(const Pose& initial, const Mesh& model, const Mesh& target, const Options& options, Context& context) {
  check_frames(initial, model, target);
  // Coordinates are relative to the target's centroid, so that PCL's single precision is enough.
  std::vector<Eigen::Vector3d> points = sample_surface(model, std::size_t(options.points)),
                               goal = sample_surface(target, std::size_t(options.target_points));
  Eigen::Vector3d middle = Eigen::Vector3d::Zero();
  for (const Eigen::Vector3d& point : goal) middle += point / double(goal.size());
  for (Eigen::Vector3d& point : points) point = initial.world_from_model * point - middle;
  for (Eigen::Vector3d& point : goal) point -= middle;
  context.check_cancelled();
  const marrow::closest_points::Result found =
      marrow::closest_points::align(points, goal, {options.max_iterations, options.reach_mm});
  if (found.paired < 3)
    throw Error(
        formatted("{} of {} points of the model have one of the target within {} mm, but three at least are needed; "
                  "give a better start, or raise reach_mm",
                  found.paired, points.size(), int(std::lround(options.reach_mm))));
  Result result;
  Pose start = initial;
  if (!start.frame.is_anatomical) start.frame = fragment_frame(model);
  start.covariance.reset();
  start.convergence.clear();
  result.stages.add("start", start);
  result.pose = start;
  result.pose.warnings.clear();
  RigidTransform& pose = result.pose.world_from_model;
  const Eigen::Matrix3d turn = nearest_orthogonal(found.motion.topLeftCorner<3, 3>());
  pose.rotation = nearest_orthogonal(turn * pose.rotation);
  pose.translation_mm = turn * (pose.translation_mm - middle) + found.motion.topRightCorner<3, 1>() + middle;
  result.pose.cost = found.rms;
  add_warnings(found, options, result.pose, context);
  result.stages.add("final", result.pose);
  return result;
}

}  // namespace

MARROW_PLUGIN(plugin) {
  plugin.node("register.icp", icp)
      .summary("Registers a surface to a surface by iterative closest points, ICP (Besl and McKay 1992; by PCL)")
      .in("start", "pose to start from, and the fragment's axes")
      .in("model", "surface of the fragment")
      .in("target", "surface in world coordinates, of the whole fragment or a part")
      .out("pose", &Result::pose,
           "pose of least distance; its cost is the root mean square distance of the pairs in mm")
      .out("stages", &Result::stages, "poses of the search: start, final", over("stage"))
      .option("max_iterations", &Options::max_iterations, "largest number of iterations; each makes new pairs",
              at_least(1))
      .option("reach_mm", &Options::reach_mm, "points of the model farther than this from the target do not count",
              at_least(1e-3))
      .option("points", &Options::points, "number of points spread over the model", at_least(10), at_most(1e6))
      .option("target_points", &Options::target_points,
              "number of points spread over the target; more points represent its surface more accurately",
              at_least(10), at_most(1e7));
}
