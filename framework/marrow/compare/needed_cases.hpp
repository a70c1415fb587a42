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

/// The probability with which so many cases show a difference of this size, one of so many comparisons: the share of
/// 1000 simulated experiments in which difference_shown() says so, with p times the number of comparisons (Bonferroni)
/// and the interval at 1 - alpha. The differences of cases are normal about it, with this spread. The experiments are
/// always the same. Throws Error for a spread below 0, or as fewest_cases() does.
double probability_to_show(double difference, double spread, std::size_t cases, std::size_t comparisons = 1,
                           double alpha = 0.05);

inline constexpr std::size_t kMostNeededCases = 1000;
/// The fewest cases with at least this probability; nothing if kMostNeededCases are too few. Throws Error as
/// probability_to_show() does, and for a probability that is not within 0 to 1.
std::optional<std::size_t> cases_to_show(double difference, double spread, std::size_t comparisons = 1,
                                         double probability = 0.8, double alpha = 0.05);

/// The least difference that so many cases show with this probability; nothing if they are too few for any. Throws
/// Error as cases_to_show() does.
std::optional<double> difference_to_show(double spread, std::size_t cases, std::size_t comparisons = 1,
                                         double probability = 0.8, double alpha = 0.05);

}  // namespace compare
}  // namespace marrow
