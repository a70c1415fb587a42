// SPDX-License-Identifier: Apache-2.0
#pragma once
// Polynomials in two variables with values in the plane, fitted by least squares.
#include <Eigen/Core>
#include <vector>

namespace marrow::distortion {

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

}  // namespace marrow::distortion
