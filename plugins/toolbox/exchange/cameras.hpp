// SPDX-License-Identifier: Apache-2.0
#pragma once
// Cameras of other programs: what their readers and writers share, and two formats.
#include <Eigen/Core>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "marrow/domain/camera.hpp"

namespace marrow::exchange {

/// How a program's images are turned over before marrow takes them. marrow's cameras see the image from the source,
/// with u to the right and v down. Some programs see it from the detector, or count rows from below.
enum class Mirror { none, left_right, upside_down };
/// From the option's text: "none", "left_right" or "upside_down".
Mirror mirror_of(const std::string& text);
/// Where a pixel of a program's image is in the image that was turned over.
Eigen::Vector2d mirrored(const Eigen::Vector2d& pixel, Mirror mirror, int width_px, int height_px);

/// What the user gave of the size of an image and of its pixels.
struct ImageSize {
  std::vector<double> size_px;
  std::vector<double> pixel_mm;   ///< one number: the pixels are square
  std::vector<double> corner_mm;  ///< the centre of the first pixel on the detector; empty: the image is centred
};
/// The image's width and height in pixels, a pixel's width and height in mm, and the place of the first pixel. Throw
/// Error if they are missing or not positive. `what` names the file that needs them.
Eigen::Vector2i size_px(const ImageSize& size, const std::string& what);
Eigen::Vector2d pixel_mm(const std::vector<double>& numbers, const std::string& what);
Eigen::Vector2d corner_mm(const ImageSize& size, const std::string& what);

/// The rotation that a matrix with few digits stands for: the nearest one, or the matrix itself if it is exact to
/// 1e-12. std::nullopt if an element differs by 1e-4 or more, because the matrix scales, shears or mirrors.
std::optional<Eigen::Matrix3d> rotation_near(const Eigen::Matrix3d& matrix);

/// The camera with pixel ~ P (x, 1), for images that are turned over as `mirror` says. P counts pixels from the centre
/// of the first one, and its third coordinate must be positive in front of the source. Throws Error if P is singular,
/// or if `mirror` is wrong: exactly one way of turning gives a camera that looks from the source. `what` names the
/// file.
Camera camera_of(const Eigen::Matrix<double, 3, 4>& pixel_from_world, const Eigen::Vector2i& size_px, Mirror mirror,
                 const std::string& what);

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
