// SPDX-License-Identifier: Apache-2.0
#include "expansions.hpp"

#include <algorithm>
#include <cmath>

namespace marrow::match {

SumsExpansion& SumsExpansion::operator+=(const SumsExpansion& more) {
  sums.values += more.sums.values;
  sums.weights += more.sums.weights;
  by_values += more.by_values;
  by_weights += more.by_weights;
  curvature += more.curvature;
  return *this;
}

SumsExpansion& SumsExpansion::operator-=(const SumsExpansion& less) {
  sums.values -= less.sums.values;
  sums.weights -= less.sums.weights;
  by_values -= less.by_values;
  by_weights -= less.by_weights;
  curvature -= less.curvature;
  return *this;
}

JointMoments& JointMoments::operator+=(const JointMoments& more) {
  n += more.n;
  if (!more.shows_bone) {
    sums[kSeen] += more.sums[kSeen];
    products(kSeen, kSeen) += more.products(kSeen, kSeen);
    return *this;
  }
  shows_bone = true;
  sums += more.sums;
  products += more.products;
  return *this;
}

JointMoments& JointMoments::operator-=(const JointMoments& less) {
  n -= less.n;
  sums -= less.sums;
  products -= less.products;
  return *this;
}

CorrelationExpansion correlation_expansion(const JointMoments& moments) {
  constexpr double kLeastPixels = 16;
  constexpr int a = JointMoments::kRendered, b = JointMoments::kSeen;
  CorrelationExpansion expansion;
  if (moments.n < kLeastPixels) return expansion;
  const JointMoments::Matrix spread = moments.spread();
  const double aa = spread(a, a), bb = spread(b, b);
  if (!(aa > 1e-9 + 1e-12 * moments.products(a, a))) return expansion;
  const Vector6d with_a = spread.col(a).head<6>();
  expansion.spread = aa;
  expansion.by_spread = 2 * with_a;
  if (!(bb > 1e-14 + 1e-12 * moments.products(b, b))) return expansion;
  const double per_deviations = 1 / std::sqrt(aa * bb);
  expansion.value = std::clamp(spread(a, b) * per_deviations, -1.0, 1.0);
  expansion.by_value = per_deviations * spread.col(b).head<6>() - expansion.value / aa * with_a;
  // The normalised radiograph is a unit vector; what changes its direction lowers the correlation.
  expansion.curvature =
      std::max(expansion.value, 0.0) / aa * (spread.topLeftCorner<6, 6>() - with_a * with_a.transpose() / aa);
  return expansion;
}

}  // namespace marrow::match
