// SPDX-License-Identifier: Apache-2.0
#pragma once
// How an image intensifier bends an image, measured with a plate of dots or holes. Unlike RadialDistortion it need not
// be symmetric about a point: it holds the S-shaped turn by the earth's magnetic field as well.
#include <Eigen/Core>
#include <cstddef>
#include <optional>
#include <string>
#include <vector>

#include "marrow/runtime/node/value.hpp"

namespace marrow::distortion {

/// A distortion of images of one size. A point that lies at a pixel of the straight image is seen at
///
///   seen_px = ideal_px + sum of terms_px[k] x^i y^j + lattice(ideal_px),
///
/// where x and y are the ideal pixel's distances from the image's middle, divided by half the longer side. The terms
/// are in the order 1, x, y, x^2, x y, y^2, x^3, ... up to `degree`. The lattice, which may be empty, has a
/// displacement at each multiple of step_px, row by row, lattice_columns() a row. Between them Catmull-Rom splines
/// interpolate. Safe to read from several threads.
struct Distortion {
  int width_px = 0, height_px = 0;
  int degree = 0;
  std::vector<Eigen::Vector2d> terms_px;
  double step_px = 0;
  std::vector<Eigen::Vector2d> lattice_px;
  std::vector<Eigen::Vector2d> area_px;  ///< corners of the convex part of the straight image that was measured
  double residual_px = 0;                ///< root mean square distance of the dots from the fit; 0 if not known
  double validated_px = 0;               ///< the same for dots that the fit did not see; 0 if not known

  bool is_none() const { return terms_px.empty() && lattice_px.empty(); }
  using fields = Fields<&Distortion::width_px, &Distortion::height_px, &Distortion::degree, &Distortion::terms_px,
                        &Distortion::step_px, &Distortion::lattice_px, &Distortion::area_px, &Distortion::residual_px,
                        &Distortion::validated_px>;
};

/// The number of terms of a polynomial of this degree in two variables.
constexpr std::size_t terms_of(int degree) { return std::size_t(degree + 1) * std::size_t(degree + 2) / 2; }

/// The distance between the nodes of a lattice for images of this size: a 32nd of the longer side.
double lattice_step_px(int width_px, int height_px);
int lattice_columns(const Distortion& distortion);
int lattice_rows(const Distortion& distortion);

/// Where the original image shows what lies at a pixel of the straight image.
Eigen::Vector2d seen_pixel(const Distortion& distortion, const Eigen::Vector2d& ideal_px);
/// The derivative of seen_pixel(), by central differences of half a pixel.
Eigen::Matrix2d seen_derivative(const Distortion& distortion, const Eigen::Vector2d& ideal_px);
/// The inverse of seen_pixel(), by Newton's method. Nothing if it finds no place inside the measured area.
std::optional<Eigen::Vector2d> ideal_pixel(const Distortion& distortion, const Eigen::Vector2d& seen_px);
/// Whether a pixel of the straight image lies in the measured area.
bool is_measured(const Distortion& distortion, const Eigen::Vector2d& ideal_px);

/// Throws Error unless the sizes fit each other, all numbers are finite, and the image is neither folded nor more than
/// doubled or halved anywhere in the measured area. `what` names the distortion in the message.
void check_distortion(const Distortion& distortion, const std::string& what);

}  // namespace marrow::distortion

MARROW_VALUE_TYPE(marrow::distortion::Distortion, "distortion", 1)
