// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <optional>

#include "marrow/base/export.hpp"
#include "marrow/domain/camera.hpp"
#include "marrow/domain/list.hpp"

namespace MARROW_EXPORT marrow {

/// The point nearest to the central rays of all views, at which they are aimed. A central ray is its camera's z axis;
/// cutting an image does not change it. Nothing for a single view, for rays within about 2.6 degrees of each other, and
/// if the point does not lie in front of every source: then the cameras do not tell how far away the bone is.
std::optional<Eigen::Vector3d> meeting_point_mm(const List<View>& views);

}  // namespace marrow
