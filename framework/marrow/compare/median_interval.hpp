// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <cstdint>
#include <optional>
#include <vector>

#include "marrow/base/export.hpp"
#include "marrow/compare/bootstrap.hpp"
#include "marrow/compare/statistics.hpp"

namespace MARROW_EXPORT marrow {
namespace compare {

/// Interval of a median with a confidence of at least 1 - level, whatever the distribution (David and Nagaraja 2003,
/// Order Statistics, section 7.1): from the j-th smallest to the j-th largest value, with the largest j that has this
/// confidence. If all looks take the levels of levels_of_looks(), their intervals hold the median at all looks together
/// with a confidence of about 1 - alpha (repeated intervals: Jennison and Turnbull 1989, J R Stat Soc B 51:305). So
/// they may be read after any look.
///
/// Values may be infinite. With too few values, the bounds are: even the range from the smallest to the largest of n
/// holds the median only with a confidence of 1 - 2^(1 - n). For 95 %, 6 values are needed. Throws Error for no values,
/// NaN, or a level not between 0 and 1.
Interval order_statistic_interval(std::vector<double> values, double level);

/// The interval of the median of a figure: of all runs, of which several may share a case. Nothing if there are too few
/// cases for order_statistic_interval(): fewer than 6 for 95 %.
///
/// With one run in each case, it is order_statistic_interval(). Else it is median_of_runs_interval() (bootstrap.hpp).
/// Throws Error for no cases, a case without values, a value that is not finite, or a confidence not between 0 and 1.
std::optional<Interval> median_interval_of(const ValuesOfCases& cases, double confidence = 0.95,
                                           std::uint64_t seed = 1);

}  // namespace compare
}  // namespace marrow
