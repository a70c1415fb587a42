// SPDX-License-Identifier: Apache-2.0
// Simulated comparisons of two variants. A planted difference is found; without one, none is shown.
#include <gtest/gtest.h>

#include <algorithm>
#include <iostream>
#include <marrow/compare/paired.hpp>
#include <random>

namespace planted_difference_test {

using namespace marrow::compare;

constexpr int case_count = 20;
constexpr int starts = 3;
constexpr int null_experiments = 500;

/// Errors of `case_count` cases in mm, a few starts each. The difference of the variants scatters from case to case
/// with sd 0.1 mm, and ten times that in every tenth case; starts of one case share most of it.
std::vector<Pair> experiment(std::mt19937_64& random, double shift_mm) {
  std::normal_distribution<double> normal;
  std::uniform_real_distribution<double> uniform;
  std::vector<Pair> pairs;
  for (int k = 0; k < case_count; ++k) {
    const double reference_mm = 0.5 + 0.2 * std::abs(normal(random));
    const double of_case_mm = (uniform(random) < 0.1 ? 1.0 : 0.1) * normal(random);
    for (int start = 0; start < starts; ++start)
      pairs.push_back(
          {"case " + std::to_string(k), reference_mm, reference_mm + shift_mm + of_case_mm + 0.03 * normal(random)});
  }
  return pairs;
}

/// A count of false findings contradicts `level` if even a 99.9 % interval of its rate lies above it.
void expect_within(int found, int experiments, double level) {
  const Interval interval =
      wilson_interval(static_cast<std::size_t>(found), static_cast<std::size_t>(experiments), 0.999);
  EXPECT_LE(interval.lower, level) << found << " of " << experiments;
}

TEST(PlantedDifference, IsNotShownWhereThereIsNone) {
  std::mt19937_64 random(1);
  int small_p = 0, shown = 0, covered = 0, starts_as_cases = 0;
  for (int i = 0; i < null_experiments; ++i) {
    const std::vector<Pair> pairs = experiment(random, 0);
    const Comparison comparison = compare_pairs(pairs, false);
    small_p += comparison.test.p < 0.05;
    shown += difference_shown(comparison, comparison.test.p);
    covered += comparison.interval.lower <= 0 && comparison.interval.upper >= 0;
    std::vector<double> differences;
    for (const Pair& pair : pairs) differences.push_back(*pair.variant - *pair.reference);
    starts_as_cases += signed_rank_test(differences).p < 0.05;
  }
  std::cout << "of " << null_experiments << " without a difference: p < 0.05 in " << small_p << ", shown in " << shown
            << ", 0 within the 95 % interval in " << covered << "; with starts taken for cases p < 0.05 in "
            << starts_as_cases << "\n";
  expect_within(small_p, null_experiments, 0.05);
  expect_within(shown, null_experiments, 0.05);
  expect_within(null_experiments - covered, null_experiments, 0.05);
  // This is why a case counts by its mean: the starts of a case are not independent evidence.
  EXPECT_GT(starts_as_cases, 3 * small_p);
}

TEST(PlantedDifference, IsNotShownAmongSeveralVariantsAfterHolm) {
  std::mt19937_64 random(2);
  int uncorrected = 0, corrected = 0;
  for (int i = 0; i < null_experiments; ++i) {
    std::vector<double> p_values;
    for (int variant = 0; variant < 5; ++variant)
      p_values.push_back(compare_pairs(experiment(random, 0), false).test.p);
    uncorrected += *std::min_element(p_values.begin(), p_values.end()) < 0.05;
    const std::vector<double> holm_p = holm(p_values);
    corrected += *std::min_element(holm_p.begin(), holm_p.end()) < 0.05;
  }
  std::cout << "five variants without a difference: one or more p < 0.05 in " << uncorrected << " of "
            << null_experiments << ", after Holm in " << corrected << "\n";
  expect_within(corrected, null_experiments, 0.05);
  EXPECT_GT(uncorrected, 2 * corrected);
}

/// The number of experiments, of 100, that show the difference of one of three variants after Holm.
int found_of_100(double shift_mm) {
  std::mt19937_64 random(3);
  int found = 0, covered = 0;
  for (int i = 0; i < 100; ++i) {
    const Comparison comparison = compare_pairs(experiment(random, shift_mm), false);
    const double p = holm({comparison.test.p, 0.5, 0.9})[0];
    found += difference_shown(comparison, p) && comparison.median_difference > 0;
    covered += comparison.interval.lower <= shift_mm && comparison.interval.upper >= shift_mm;
  }
  std::cout << shift_mm << " mm planted, as one of three variants: found in " << found
            << " of 100, within the 95 % interval in " << covered << "\n";
  EXPECT_GE(covered, 90);
  return found;
}

TEST(PlantedDifference, IsFound) {
  EXPECT_GE(found_of_100(0.1), 60);  // one sd of the bulk of the cases
  EXPECT_GE(found_of_100(0.2), 95);
}

}  // namespace planted_difference_test
