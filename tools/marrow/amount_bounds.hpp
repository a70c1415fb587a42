// SPDX-License-Identifier: Apache-2.0
#pragma once

namespace marrow::cli {

/// Bounds for megabytes and seconds: above 0, and small enough for clocks and counters.
inline constexpr double kLeastAmount = 0.001, kMostAmount = 1e9;

}  // namespace marrow::cli
