// SPDX-License-Identifier: Apache-2.0
#pragma once
// The axes about and along which a bone is moved by a search, or from frame to frame.
#include <marrow/domain/pose.hpp>
#include <marrow/runtime/node/context.hpp>

namespace marrow::geometry {

/// The pose with the axes of its fragment: its own, or those of `model`, the surface of the fragment, which may be
/// null. A covariance is turned into these axes. If there are neither, the pose stays as it is, and its frame is not
/// anatomical. Throws Error if the model is not in the frame of the pose's points.
Pose about_fragment_axes(Pose pose, const Mesh* model);

/// The same for a pose to start from. If it stays as it is, a warning goes to the log.
Pose with_fragment_axes(Pose start, const Mesh* model, const Context& context);

}  // namespace marrow::geometry
