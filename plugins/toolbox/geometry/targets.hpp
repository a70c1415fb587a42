// SPDX-License-Identifier: Apache-2.0
#pragma once
// The common part of measures that compare a pose with the truth: whether the two can be compared, and at which points.
#include <marrow/domain/features.hpp>
#include <marrow/domain/pose.hpp>
#include <vector>

namespace marrow::geometry {

/// Throws Error unless both are rigid and between the same two frames. `other` names the second one in the message.
void check_poses(const RigidTransform& pose, const RigidTransform& truth, const std::string& other = "truth");

/// Throws Error unless the model is in the pose's source frame.
void check_model(const RigidTransform& pose, const Mesh& model);

/// The targets in the frame of the CT: the points of the landmarks if there are landmarks, else `points` points spread
/// over the model's surface. Model and landmarks may be null. Throws Error if both are, if the landmarks have no
/// points, or if check_mesh() or check_model() refuses the model.
std::vector<Eigen::Vector3d> targets_mm(const RigidTransform& pose, const Mesh* model, const Landmarks* landmarks,
                                        int points);

/// For each target the distance between its positions under the pose and under the truth.
std::vector<double> target_errors_mm(const RigidTransform& pose, const RigidTransform& truth,
                                     const std::vector<Eigen::Vector3d>& targets_mm);

/// These two need at least one value.
double mean(const std::vector<double>& values);
double root_mean_square(const std::vector<double>& values);

}  // namespace marrow::geometry
