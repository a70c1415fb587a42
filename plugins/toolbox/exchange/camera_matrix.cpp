// SPDX-License-Identifier: Apache-2.0
#include "marrow/toolbox/exchange/camera_matrix.hpp"

#include <Eigen/Geometry>
#include <cmath>

#include "marrow/base/error.hpp"
#include "marrow/base/number_text.hpp"
#include "marrow/domain/decompositions.hpp"
#include "marrow/toolbox/files/projection_camera.hpp"

namespace marrow::exchange {
namespace {

constexpr double kLargestSide_px = 65536;

/// Turns pixels of a program's image into those of the image that was turned over.
Eigen::Matrix3d turning(Mirror mirror, int width_px, int height_px) {
  Eigen::Matrix3d turn = Eigen::Matrix3d::Identity();
  if (mirror == Mirror::left_right) turn.row(0) << -1, 0, width_px - 1;
  if (mirror == Mirror::upside_down) turn.row(1) << 0, -1, height_px - 1;
  return turn;
}

}  // namespace

Mirror mirror_of(const std::string& text) {
  return text == "left_right" ? Mirror::left_right : text == "upside_down" ? Mirror::upside_down : Mirror::none;
}

Eigen::Vector2d mirrored(const Eigen::Vector2d& pixel, Mirror mirror, int width_px, int height_px) {
  return (turning(mirror, width_px, height_px) * pixel.homogeneous()).head<2>();
}

Eigen::Vector2i size_px(const ImageSize& size, const std::string& what) {
  if (size.size_px.empty())
    throw Error(what +
                ": does not say how many pixels the image has; wire the image, or give image_size_px: [width, height]");
  if (size.size_px.size() != 2)
    throw Error(formatted("{}: image_size_px: expected [width, height], got {} numbers", what, size.size_px.size()));
  for (const double side : size.size_px)
    if (!(side >= 1 && side <= kLargestSide_px) || side != std::floor(side))
      throw Error(formatted("{}: image_size_px: expected 1 to 65536 pixels each way, got {:f}", what, side));
  return {int(size.size_px[0]), int(size.size_px[1])};
}

Eigen::Vector2d pixel_mm(const std::vector<double>& numbers, const std::string& what) {
  if (numbers.empty())
    throw Error(what + ": needs the size of a pixel on the detector; give pixel_mm: [width, height]");
  if (numbers.size() > 2)
    throw Error(formatted("{}: pixel_mm: expected [width, height], or one number for square pixels, got {}", what,
                          numbers.size()));
  for (const double side : numbers)
    if (!(side >= 1e-6 && side <= 1000))
      throw Error(formatted("{}: pixel_mm: expected a size in mm between 1e-6 and 1000, got {:f}", what, side));
  return {numbers.front(), numbers.back()};
}

Eigen::Vector2d corner_mm(const ImageSize& size, const std::string& what) {
  if (size.corner_mm.empty())
    return -0.5 *
           (size_px(size, what).cast<double>() - Eigen::Vector2d::Ones()).cwiseProduct(pixel_mm(size.pixel_mm, what));
  if (size.corner_mm.size() != 2)
    throw Error(formatted(
        "{}: corner_mm: expected [u, v], the place of the first pixel's centre on the detector, got {} numbers", what,
        size.corner_mm.size()));
  return {size.corner_mm[0], size.corner_mm[1]};
}

std::optional<Eigen::Matrix3d> rotation_near(const Eigen::Matrix3d& matrix) {
  const Eigen::Matrix3d nearest = nearest_orthogonal(matrix);
  const double defect = (nearest - matrix).cwiseAbs().maxCoeff();
  if (!(defect < 1e-4) || nearest.determinant() < 0) return std::nullopt;
  return defect < 1e-12 ? matrix : nearest;
}

Camera camera_of(const Eigen::Matrix<double, 3, 4>& pixel_from_world, const Eigen::Vector2i& size_px, Mirror mirror,
                 const std::string& what) {
  const auto found = files::camera_of_projection(turning(mirror, size_px.x(), size_px.y()) * pixel_from_world, size_px);
  if (!found)
    throw Error(what + ": its matrix does not project along rays from a source; it is damaged, or of parallel rays");
  if (found->is_mirrored && mirror == Mirror::none)
    throw Error(what +
                ": its images are seen from the detector, or have their rows from below; turn them over by mirror: "
                "left_right or upside_down when they are read, and give the same mirror here");
  if (found->is_mirrored) throw Error(what + ": its images are seen from the source as marrow's are; leave mirror out");
  check_camera(found->camera, what);
  return found->camera;
}

}  // namespace marrow::exchange
