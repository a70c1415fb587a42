// SPDX-License-Identifier: Apache-2.0
#pragma once
// Quantiles, and the checks of what they are taken from.
#include <cstddef>
#include <string>
#include <vector>

namespace marrow::compare {

/// Throws Error for no values, or for one that is not finite. `what` names one of them in the message.
void check_finite(const std::vector<double>& values, const std::string& what);
/// Throws Error if there are too few for bounds.
void check_resamples(std::size_t resamples);

/// Type 7 of Hyndman and Fan 1996 (statistics.hpp).
double quantile(const std::vector<double>& sorted, double fraction);
double median_of_sorted(const std::vector<double>& sorted);
/// The median of values in any order. Changes their order.
double median_in_place(std::vector<double>& values);

}  // namespace marrow::compare
