// SPDX-License-Identifier: Apache-2.0
#pragma once
// Checks of the values and settings of quantiles and their intervals.
#include <cstddef>
#include <string>
#include <vector>

namespace marrow::compare {

/// Throws Error for no values, or for one that is not finite. `what` is the word for one value in the message.
void check_finite(const std::vector<double>& values, const std::string& what);
/// The same, but values may be infinite.
void check_numbers(const std::vector<double>& values, const std::string& what);
/// Throws Error for a confidence that is not between 0 and 1.
void check_confidence(double confidence);
/// Throws Error if there are too few for bounds.
void check_resamples(std::size_t resamples);

}  // namespace marrow::compare
