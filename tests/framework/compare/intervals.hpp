// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <marrow/compare/statistics.hpp>

namespace intervals {

using Bounds = std::pair<double, double>;

inline Bounds bounds(const marrow::compare::Interval& interval) { return {interval.lower, interval.upper}; }

}  // namespace intervals
