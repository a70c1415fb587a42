// SPDX-License-Identifier: Apache-2.0
#pragma once
// How much a cost of images counts beside what is known from elsewhere.
#include <string>

#include "marrow/domain/functions.hpp"

namespace marrow::similarity {

/// The value in a cost of one unit of the negative log-likelihood: twice the rise of the cost if the pose moves by one
/// standard deviation. The median over six directions. `found`: the cost's minimum, which check_found() accepts.
double noise_of(const Cost& cost, const Pose& found);

/// Throws Error if check_pose() refuses the pose, or if its covariance is absent or not positive definite. The message
/// begins with `name` and ends with `remedy`.
void check_known(const Pose& pose, const std::string& name, const std::string& remedy);
/// Throws Error unless a pose that a registration has found by a cost has a finite covariance.
void check_found(const Pose& found);

}  // namespace marrow::similarity
