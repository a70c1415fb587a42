// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <limits>

namespace marrow::compare {

/// A difference that a failure makes, or a bound that too few cases leave open.
inline constexpr double kInfinite = std::numeric_limits<double>::infinity();

}  // namespace marrow::compare
