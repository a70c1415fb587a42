// SPDX-License-Identifier: Apache-2.0
#include "marrow/toolbox/search/compared.hpp"

#include <algorithm>
#include <cmath>

#include "predicted_covariance.hpp"

namespace marrow::search {
namespace {

constexpr double kRounding = 1e-12;  // relative

/// Whether a cost is the same at all poses around. It is asked for one pose after the other, because the first one
/// tells nearly always.
bool is_constant(const Cost& cost, double here, const RigidTransform& pose, const FragmentFrame& frame) {
  for (const double step : {0.5, 4.0, 16.0})
    for (int axis = 0; axis < 6; ++axis)
      for (const double sense : {1.0, -1.0}) {
        const double there = cost.value(moved_by_units(pose, frame, sense * step * Vector6d::Unit(axis)));
        if (!(std::abs(there - here) <= kRounding * std::max(std::abs(there), std::abs(here)))) return false;
      }
  return true;
}

}  // namespace

std::string nothing_compared(const Cost& cost, const RigidTransform& pose, const FragmentFrame& frame) {
  const std::string said = cost.nothing_compared(pose);
  if (!said.empty()) return said;
  const double here = cost.value(pose);
  if (!std::isfinite(here)) return "the cost is not a number";
  return is_constant(cost, here, pose, frame) ? "the cost is the same at all poses within 16 degrees and mm" : "";
}

void refuse_pose(const std::string& why, const std::string& which) {
  throw Error("the images say nothing about " + which + ": " + why +
              "; give a start nearer to the bone, or see whether the masks, the edges and the model are right");
}

void check_compared(const Cost& cost, const RigidTransform& pose, const FragmentFrame& frame) {
  if (const std::string why = nothing_compared(cost, pose, frame); !why.empty()) refuse_pose(why);
}

void warn_of_silent_views(const Cost& cost, Pose& pose, const Context& context) {
  for (const std::string& view : cost.silent_views(pose.world_from_model)) {
    const std::string warning = view + "; only the other views count";
    if (std::find(pose.warnings.begin(), pose.warnings.end(), warning) != pose.warnings.end()) continue;
    pose.warnings.push_back(warning);
    context.warn(warning);
  }
}

}  // namespace marrow::search
