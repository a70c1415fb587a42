// SPDX-License-Identifier: Apache-2.0
#pragma once
// Lengths that no bone or device has, and the unit that they are likely in.
#include <string>

#include "marrow/domain/camera.hpp"

namespace marrow::files {

/// The sentence part "; looks like cm: give scale: 10" for a length that was read with `scale` and lies outside of
/// `least_mm` to `most_mm`. It names the first of cm, m, inches and micrometres in which the length would lie within;
/// empty if there is none.
std::string likely_unit(double length_mm, double least_mm, double most_mm, double scale);

/// A sentence if no X-ray device has the distance between this camera's source and the world's origin. Empty if the
/// distance is possible, or 0. `scale`: the one with which the camera was read.
std::string doubt_about_distance(const Camera& camera, double scale);

}  // namespace marrow::files
