// SPDX-License-Identifier: Apache-2.0
#include "marrow/toolbox/geometry/targets.hpp"

#include <cmath>

#include "marrow/base/error.hpp"

namespace marrow::geometry {

void check_poses(const RigidTransform& pose, const RigidTransform& truth, const std::string& other) {
  check_rigid(pose, "pose");
  check_rigid(truth, other);
  const auto name = [](const RigidTransform& t) { return t.target + "_from_" + t.source; };
  if (pose.target != truth.target || pose.source != truth.source)
    throw Error("the pose is " + name(pose) + ", but the " + other + " is " + name(truth) +
                "; compare poses between the same two frames");
}

void check_model(const RigidTransform& pose, const Mesh& model) {
  if (model.frame != pose.source)
    throw Error("the model is in the frame '" + model.frame + "', but the pose takes points in '" + pose.source +
                "'; give the model that was registered");
}

std::vector<Eigen::Vector3d> targets_mm(const RigidTransform& pose, const Mesh* model, const Landmarks* landmarks,
                                        int points) {
  if (landmarks) {
    if (landmarks->points.empty())
      throw Error("the landmarks have no points in the CT; leave them out to measure on the model's surface");
    std::vector<Eigen::Vector3d> targets;
    for (const Landmarks::Point& point : landmarks->points) targets.push_back(point.model_mm);
    return targets;
  }
  if (!model) throw Error("there is nothing to measure at; wire a model, whose surface is sampled, or landmarks");
  check_mesh(*model, "model");
  check_model(pose, *model);
  return sample_surface(*model, std::size_t(points));
}

std::vector<double> target_errors_mm(const RigidTransform& pose, const RigidTransform& truth,
                                     const std::vector<Eigen::Vector3d>& targets_mm) {
  std::vector<double> errors;
  for (const Eigen::Vector3d& target : targets_mm) errors.push_back((pose * target - truth * target).norm());
  return errors;
}

double mean(const std::vector<double>& values) {
  double sum = 0;
  for (const double value : values) sum += value;
  return sum / double(values.size());
}

double root_mean_square(const std::vector<double>& values) {
  double sum = 0;
  for (const double value : values) sum += value * value;
  return std::sqrt(sum / double(values.size()));
}

}  // namespace marrow::geometry
