// SPDX-License-Identifier: Apache-2.0
#pragma once
// What remains of an image after a radiograph is subtracted (Weese 1997; Penney et al. 1998).
#include "marrow/similarity/intensity.hpp"

namespace marrow::match {

/// d^2 / (variance + d^2): 0 where nothing remains, near 1 for differences much larger than the deviation.
struct Structure {
  double variance = 1;

  double operator()(double d) const { return d * d / (variance + d * d); }
  /// How much less remains of `seen` after scale * rendered is subtracted.
  double removed(double seen, double rendered, double scale) const {
    return (*this)(seen) - (*this)(seen - scale * rendered);
  }
  /// The same with derivatives; `slopes` are those of `rendered`.
  SumsExpansion removed(double seen, double rendered, const Vector6d& slopes, const Scale& scale) const {
    const double d = seen - scale.value * rendered, all = variance + d * d, weight = 2 * variance / (all * all);
    const Vector6d change = rendered * scale.slopes + scale.value * slopes;
    return {{removed(seen, rendered, scale.value), 0},
            weight * d * change,
            Vector6d::Zero(),
            weight * change * change.transpose()};
  }
};

}  // namespace marrow::match
