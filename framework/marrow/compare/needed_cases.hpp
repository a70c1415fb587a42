// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <cstddef>
#include <optional>
#include <vector>

#include "marrow/base/export.hpp"

// How many cases a difference takes, planned from the cases that there are.
namespace MARROW_EXPORT marrow {
namespace compare {

/// How differences scatter over cases: their standard deviation about the mean. Infinite ones, which failures make, are
/// left out. Nothing for fewer than three others.
std::optional<double> spread_of_differences(const std::vector<double>& differences);

/// The probability with which so many cases show a difference of this size (difference_shown()), one of so many
/// comparisons, at p < alpha. The differences of cases are normal about it, with this spread. It is the less probable
/// one of two things, each by Noether 1987 (J Am Stat Assoc 82:645): that Wilcoxon's signed-rank test reaches alpha
/// divided by the number of comparisons, and that the sign test reaches alpha, which stands for an interval without 0.
/// 0 for fewer than fewest_cases(). In 1000 simulated experiments each, with 1, 6 and 20 comparisons and differences of
/// 0.3 and 0.5 times the spread, 76 to 83 % showed the difference where this says 80 %, and 87 to 100 % with larger
/// differences. Throws Error for a spread below 0, or as fewest_cases() does.
double probability_to_show(double difference, double spread, std::size_t cases, std::size_t comparisons = 1,
                           double alpha = 0.05);

/// The fewest cases with at least this probability; nothing if a million are too few. Throws Error as
/// probability_to_show() does, and for a probability that is not within 0 to 1.
std::optional<std::size_t> cases_to_show(double difference, double spread, std::size_t comparisons = 1,
                                         double probability = 0.8, double alpha = 0.05);

/// The least difference that so many cases show with this probability; nothing if they are too few for any. Throws
/// Error as cases_to_show() does.
std::optional<double> difference_to_show(double spread, std::size_t cases, std::size_t comparisons = 1,
                                         double probability = 0.8, double alpha = 0.05);

}  // namespace compare
}  // namespace marrow
