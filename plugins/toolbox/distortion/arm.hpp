// SPDX-License-Identifier: Apache-2.0
#pragma once
// A distortion that changes with the pose of the arm: measured at some poses, interpolated between them.
#include <Eigen/Core>
#include <vector>

#include "marrow/domain/list.hpp"
#include "marrow/toolbox/distortion/distortion.hpp"

namespace marrow::distortion {

/// A pose of the arm: one or two numbers, such as its angles in degrees.
using ArmPose = Eigen::VectorXd;

/// The shares of the measured poses at another pose. They sum to 1. At a measured pose its share is 1. In between they
/// are those of the smoothest interpolation: with one number natural cubic splines, with two the radial functions r^3
/// with a linear trend (Wendland, Scattered Data Approximation, 2005, section 8.3). Beyond the measured poses the trend
/// goes on. Where the poses do not determine a trend, as with only one pose, it is constant.
Eigen::VectorXd shares_at(const std::vector<ArmPose>& measured, const ArmPose& pose);

/// Whether a pose lies between the measured ones: in the convex hull of them, by less than 1e-6.
bool is_between(const std::vector<ArmPose>& measured, const ArmPose& pose);

/// The sum of distortions with these shares. Its area is the part that all of them measured. Throws Error if they are
/// of images of different sizes, have lattices of different steps, or if no area is common to all.
Distortion mixed(const List<Distortion>& distortions, const Eigen::VectorXd& shares);

}  // namespace marrow::distortion
