// SPDX-License-Identifier: Apache-2.0
#pragma once
// The shape of a closed outline by Fourier descriptors (Zahn and Roskies, IEEE Trans Comput 1972; for implants Banks
// and Hodge, IEEE TMI 1996).
#include <Eigen/Core>
#include <array>
#include <complex>
#include <vector>

namespace marrow::initial {

/// Points evenly spaced along the outline as complex numbers, x + i y, are a periodic signal. Its constant term is
/// where the outline lies, the norm of the others is its size, and the others divided by this norm are its shape. A
/// turn of the outline multiplies them by a phase, another starting point by a phase that is proportional to the order.
struct OutlineShape {
  static constexpr int kOrders = 24;  ///< orders -24 to 24 are kept, without 0
  std::complex<double> middle;
  double size = 0;  ///< root mean square distance of the outline from its middle
  std::array<std::complex<double>, 2 * kOrders> terms{};
};

/// The shape of a closed polygon; its last point is joined to the first. Throws Error if it has no length.
OutlineShape outline_shape(const std::vector<Eigen::Vector2d>& polygon);

/// How alike two shapes are in the best turn, over all starting points.
struct Likeness {
  double value = 0;  ///< 1: the same; the mean square distance of the outlines is 2 (1 - value) of their size squared
  double turn_rad = 0;  ///< by which `drawn` is turned (from x to y) to lie on `seen`
};
Likeness likeness(const OutlineShape& seen, const OutlineShape& drawn);

}  // namespace marrow::initial
