// SPDX-License-Identifier: Apache-2.0
#pragma once
// Whether a cost has compared anything at a pose. A cost that has compared nothing is the same at all poses around. Any
// of them would pass for its minimum, with a deviation of 0.
#include <string>

#include "marrow/plugin.hpp"

namespace marrow::search {

/// Why the images say nothing about a pose: what the cost itself says, or that it is not a number there, or the same at
/// all poses 0.5 to 16 degrees and mm away along the axes of `frame`. Empty if they say something.
std::string nothing_compared(const Cost& cost, const RigidTransform& pose, const FragmentFrame& frame);
/// Throws Error if the images say nothing about a pose that was found.
void check_compared(const Cost& cost, const RigidTransform& pose, const FragmentFrame& frame);
/// The error for this reason.
[[noreturn]] void refuse_pose(const std::string& why_nothing_is_compared,
                              const std::string& which = "the pose that was found");

/// Adds a warning for each view that says nothing about the pose, to the pose and to the log, unless the pose already
/// has it.
void warn_of_silent_views(const Cost& cost, Pose& pose, const Context& context);

}  // namespace marrow::search
