// SPDX-License-Identifier: Apache-2.0
#pragma once
// A distortion from points whose places in the straight image are known; and one that changes with the pose of the arm:
// measured at some poses, interpolated between them.
#include <Eigen/Core>
#include <utility>
#include <vector>

#include "marrow/toolbox/distortion/distortion.hpp"

namespace marrow::distortion {

/// `local` adds to the polynomial what remains near each place: a weighted plane through the residuals of the nearest
/// points. `automatic` takes it where it lowers the validated residual by more than 5 %.
enum class Model { automatic, polynomial, local };

struct FitOptions {
  Model model = Model::automatic;
  int lowest_degree = 3, highest_degree = 7;
  double outlier_deviations = 5;
  double area_margin_px = 0;  ///< the measured area reaches this far beyond the points
};

/// The result of a fit. `used` of the points tells which were kept.
struct Fit {
  Distortion distortion;
  PlatePoints points;
  std::vector<std::pair<int, double>> validated_by_degree_px;  ///< degree, and residual of points that it did not see
  bool is_local = false;
};

/// Fits a distortion to the used points. The degree is the lowest whose validated residual is as good as the least, as
/// far as n points tell: within 1 / sqrt(n) of it, but at least 1 %. For that residual, five fits each leave out
/// another fifth of the points (five-fold cross-validation). Points farther from the fit than `outlier_deviations`
/// standard deviations are not used. Residuals are root mean squares of distances. Throws Error if there are fewer than
/// three points for each term of the lowest degree.
Fit fit_distortion(const PlatePoints& points, const FitOptions& options);

/// How the distortion bends the image: what a person compares between poses of the arm.
struct Shape {
  double turn_deg = 0;       ///< S-shape: the turn at the rim against the middle, positive clockwise on the screen
  double pincushion_px = 0;  ///< how far a point at the rim is moved outwards
  double rim_px = 0;         ///< distance of the farthest used point from the image's middle, in the straight image
};

/// Turn and pincushion by least squares, with the square of the distance from the image's middle.
Shape shape_of(const Distortion& distortion, const PlatePoints& points);

/// A pose of the arm: one or two numbers, such as its angles in degrees.
using ArmPose = Eigen::VectorXd;

/// The shares of the measured poses at another pose. They sum to 1. At a measured pose its share is 1. In between they
/// are those of the smoothest interpolation: with one number natural cubic splines, with two the radial functions r^3
/// with a linear trend (Wendland, Scattered Data Approximation, 2005, section 8.3). Beyond the measured poses the trend
/// goes on. Where the poses do not determine a trend, as with only one pose, it is constant.
Eigen::VectorXd shares_at(const std::vector<ArmPose>& measured, const ArmPose& pose);

/// Whether a pose lies between the measured ones: in the convex hull of them, by less than 1e-6.
bool is_between(const std::vector<ArmPose>& measured, const ArmPose& pose);

/// The sum of distortions with these shares. Its area is the part that all of them measured. Throws Error if they are
/// of images of different sizes, have lattices of different steps, or if no area is common to all.
Distortion mixed(const List<Distortion>& distortions, const Eigen::VectorXd& shares);

}  // namespace marrow::distortion
