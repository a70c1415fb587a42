// SPDX-License-Identifier: Apache-2.0
#pragma once

namespace marrow::match {

/// Sums over pairs of values (a, b), from which their variances and covariance follow. Sums over parts may be added.
struct Moments {
  double n = 0, a = 0, b = 0, aa = 0, bb = 0, ab = 0;

  void add(double x, double y) { *this += {1, x, y, x * x, y * y, x * y}; }
  Moments& operator+=(const Moments& more) {
    n += more.n, a += more.a, b += more.b, aa += more.aa, bb += more.bb, ab += more.ab;
    return *this;
  }
  /// Sums of the products of the differences to the means. They need n > 0.
  double spread_a() const { return aa - a * a / n; }
  double spread_b() const { return bb - b * b / n; }
  double spread_ab() const { return ab - a * b / n; }
};

}  // namespace marrow::match
