// SPDX-License-Identifier: Apache-2.0
#pragma once

namespace marrow::cli {

/// Of megabytes and seconds: more than nothing, and less than what a clock or a counter cannot hold.
inline constexpr double kLeastAmount = 0.001, kMostAmount = 1e9;

}  // namespace marrow::cli
