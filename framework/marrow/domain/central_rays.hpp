// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <optional>

#include "marrow/base/export.hpp"
#include "marrow/domain/camera.hpp"
#include "marrow/domain/list.hpp"

namespace MARROW_EXPORT marrow {

/// The point at which all views are aimed: it has the least sum of squared distances to their central rays. A central
/// ray is a camera's z axis, so cropping an image does not change it. Returns nothing for a single view, for rays
/// within about 2.6 degrees of each other, and if the point is not in front of every source. In these cases the cameras
/// do not tell how far away the bone is.
std::optional<Eigen::Vector3d> meeting_point_mm(const List<View>& views);

}  // namespace marrow
