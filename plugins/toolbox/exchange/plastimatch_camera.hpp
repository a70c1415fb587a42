// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <filesystem>
#include <string>

#include "marrow/domain/camera.hpp"
#include "marrow/toolbox/exchange/camera_matrix.hpp"

namespace marrow::exchange {

/// Whether the file begins with two numbers. plastimatch's projection matrices do, XMALab's cameras do not. False if
/// there is no such file.
bool is_plastimatch_camera(const std::filesystem::path& path);

/// The camera that plastimatch (drr, fdk) wrote beside an image: two numbers, the pixel that the central ray meets
/// (column, row); a 3x4 matrix from the world, in mm, to pixels counted from there; the distances of the isocentre and
/// the detector from the source; the direction of the central ray; the matrix's factors, each below its title,
/// Extrinsic (4x4) and Intrinsic (3x4). The file does not hold the image's size. Throws Error with the line for a
/// damaged file, or one whose factors do not give its matrix.
Camera read_plastimatch_camera(const std::filesystem::path& path, const ImageSize& size);

/// The same file for a camera. plastimatch's matrix does not depend on `pixel_mm`, but its two distances do.
std::string plastimatch_camera(const Camera& camera, const Eigen::Vector2d& pixel_mm);

}  // namespace marrow::exchange
