// SPDX-License-Identifier: Apache-2.0
#pragma once
// What the figures about a pose and its truth share: whether the two may be compared, and the points at which they are.
#include <marrow/domain/landmarks.hpp>
#include <marrow/domain/mesh.hpp>
#include <marrow/domain/pose.hpp>
#include <vector>

namespace marrow::geometry {

/// Throws Error unless both are rigid and between the same two frames; `other` is what it calls the second.
void check_poses(const RigidTransform& pose, const RigidTransform& truth, const std::string& other = "truth");

/// Throws Error unless the model is in the frame that the pose takes points in.
void check_model(const RigidTransform& pose, const Mesh& model);

/// The targets in the frame of the CT: the landmarks' points where there are landmarks, else so many points spread over
/// the model's surface. Throws Error where both are missing, or where they do not go with the pose.
std::vector<Eigen::Vector3d> targets_mm(const RigidTransform& pose, const Mesh* model, const Landmarks* landmarks,
                                        int points);

/// How far the pose takes each target from where the truth does.
std::vector<double> target_errors_mm(const RigidTransform& pose, const RigidTransform& truth,
                                     const std::vector<Eigen::Vector3d>& targets_mm);

double mean(const std::vector<double>& values);
double root_mean_square(const std::vector<double>& values);
/// Quantile with linear interpolation between order statistics.
double quantile(std::vector<double> values, double fraction);

}  // namespace marrow::geometry
