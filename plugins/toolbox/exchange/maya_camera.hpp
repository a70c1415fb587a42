// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <filesystem>

#include "marrow/domain/camera.hpp"

namespace marrow::exchange {

/// Whether the file begins with three numbers that are separated by commas, as a MayaCam of version 1 does. XMALab's
/// cameras begin with a title. False if there is no such file.
bool is_maya_camera(const std::filesystem::path& path);

/// A camera of the X-ray Project's MayaCam, version 1 (.csv), as Autoscoper reads it (its documentation, "Camera
/// Calibration File Format"). Five lines of three numbers: the source in the world; the turns about x, y and z in
/// degrees, of which that about z comes first and each of the others is about the axis that was turned; the middle of
/// the film, which is not used; the principal point in pixels, counted from 1 and from the lower left, and minus the
/// focal length in pixels; a scale, which is not used, and the image's width and height (0: 1024). The camera looks
/// along its -z, with x to the right and y up. Lengths are taken as mm. Throws Error with the line for a damaged file.
Camera read_maya_camera(const std::filesystem::path& path);

}  // namespace marrow::exchange
