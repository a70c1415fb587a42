// SPDX-License-Identifier: Apache-2.0
#pragma once
// How an image intensifier bends an image, measured with a plate of dots or holes. Unlike RadialDistortion it need not
// be symmetric about a point: it holds the S-shaped turn by the earth's magnetic field as well.
#include <Eigen/Core>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "marrow/domain/camera.hpp"
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
/// The inverse of seen_pixel(), by Newton's method. Nothing if it finds no place inside the measured area.
std::optional<Eigen::Vector2d> ideal_pixel(const Distortion& distortion, const Eigen::Vector2d& seen_px);
/// Whether a pixel of the straight image lies in the measured area.
bool is_measured(const Distortion& distortion, const Eigen::Vector2d& ideal_px);

/// Throws Error unless the sizes fit each other, all numbers are finite, and the image is neither folded nor more than
/// doubled or halved anywhere in the measured area. `what` names the distortion in the message.
void check_distortion(const Distortion& distortion, const std::string& what);

/// Points of a plate in an image of this size: where the straight image shows each, and where it was seen. `used` is 0
/// for a point that was found to be wrong. All lists have the same length.
struct PlatePoints {
  int width_px = 0, height_px = 0;
  std::vector<Eigen::Vector2d> ideal_px, seen_px;
  std::vector<std::uint8_t> used;

  void add(const Eigen::Vector2d& ideal, const Eigen::Vector2d& seen, bool is_used = true) {
    ideal_px.push_back(ideal);
    seen_px.push_back(seen);
    used.push_back(is_used ? 1 : 0);
  }
  using fields = Fields<&PlatePoints::width_px, &PlatePoints::height_px, &PlatePoints::ideal_px, &PlatePoints::seen_px,
                        &PlatePoints::used>;
};

/// A polynomial map of the plane. Its variables are the distances from `middle`, divided by `half`.
struct Polynomial {
  int degree = 0;
  Eigen::Vector2d middle = Eigen::Vector2d::Zero();
  double half = 1;
  std::vector<Eigen::Vector2d> terms;  ///< in the order 1, x, y, x^2, x y, y^2, ...

  Eigen::Vector2d at(const Eigen::Vector2d& place) const;
  Eigen::Matrix2d derivative_at(const Eigen::Vector2d& place) const;
};

/// The polynomial of this degree with these variables that is nearest to the values by least squares. There must be at
/// least as many places as terms.
Polynomial fit_polynomial(int degree, const Eigen::Vector2d& middle, double half,
                          const std::vector<Eigen::Vector2d>& places, const std::vector<Eigen::Vector2d>& values);

/// The same where some values are wrong: in four rounds, values farther from the fit than `deviations` standard
/// deviations, as the median tells them, are left out. `is_used` says which were kept.
Polynomial fit_robustly(int degree, const Eigen::Vector2d& middle, double half,
                        const std::vector<Eigen::Vector2d>& places, const std::vector<Eigen::Vector2d>& values,
                        double deviations, std::vector<bool>& is_used);

/// The square that holds all places: its middle and half its side.
std::pair<Eigen::Vector2d, double> square_around(const std::vector<Eigen::Vector2d>& places);

/// Resamples image and mask to the straight image. Its camera stays as it is. Pixels whose place lies outside the
/// original image or the measured area are masked out. Throws Error as check_view() and check_distortion() do, and if
/// the image has another size than the distortion's.
void straighten(View& view, const Distortion& distortion);

/// The mask of the straight image. Each pixel gets the value of the pixel of `original` that is nearest to its place
/// there, or zero outside the original image and the measured area.
cv::Mat1b straightened_mask(const cv::Mat1b& original, const Distortion& distortion);

/// Converts a mask that was drawn on the straight image to the original image. straightened_mask() of the result is
/// zero wherever `straight` is zero. Original pixels that the straight image does not show are 255.
cv::Mat1b original_mask(const cv::Mat1b& straight, const Distortion& distortion);

}  // namespace marrow::distortion

MARROW_VALUE_TYPE(marrow::distortion::Distortion, "distortion", 1)

MARROW_VALUE_TYPE(marrow::distortion::PlatePoints, "plate_points", 1)
