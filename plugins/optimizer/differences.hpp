// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <Eigen/Core>

#include "evaluations.hpp"

/// Where to look for the slope along coordinate i: h to either side of y, or on one side twice where there is a bound.
struct Sides {
  Eigen::VectorXd low, high;
  double width = 0;

  Sides(const Evaluations& evaluate, const Eigen::VectorXd& y, Eigen::Index i, double h) : low(y), high(y) {
    low[i] -= h;
    high[i] += h;
    low = evaluate.within(low);
    high = evaluate.within(high);
    width = high[i] - low[i];
  }
};

/// The gradient by central differences, in the units of Evaluations; 2 n evaluations. 0 along a coordinate whose bounds meet.
inline Eigen::VectorXd gradient_by_differences(Evaluations& evaluate, const Eigen::VectorXd& y, double h) {
  Eigen::VectorXd gradient = Eigen::VectorXd::Zero(y.size());
  for (Eigen::Index i = 0; i < y.size(); ++i) {
    const Sides sides(evaluate, y, i, h);
    if (sides.width > 0) gradient[i] = (evaluate(sides.high) - evaluate(sides.low)) / sides.width;
  }
  return gradient;
}
