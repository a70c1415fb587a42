// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <cstddef>
#include <optional>
#include <string>
#include <vector>

#include "marrow/compare/statistics.hpp"

// A variant compared with the reference on the same cases. A run without a figure counts as a failure, and failures
// decide before values do: a variant that loses the hard cases is not better for it.
namespace MARROW_EXPORT marrow {
namespace compare {

/// The values of a metric for two variants that ran on the same case from the same start (or seed). A case may have
/// several pairs. Empty: that run has no figure, because it failed, or because a node that makes it failed.
struct Pair {
  std::string case_name;
  std::optional<double> reference, variant;
};

/// Counts runs by who has a figure, or cases by what decides them.
struct Tally {
  std::size_t both = 0;            ///< runs with both figures; cases compared by their values
  std::size_t variant_lost = 0;    ///< runs that only the variant lost; cases in which it lost more runs
  std::size_t reference_lost = 0;  ///< the same of the reference
  std::size_t neither = 0;         ///< runs that both lost; cases that say nothing, and are left out
  std::size_t all() const { return both + variant_lost + reference_lost + neither; }
};

/// Differences (variant - reference) over cases. Starts of one case share its CT and views, so they are not independent
/// evidence: a case counts once, however many starts it has.
struct CaseDifferences {
  /// One for each case that can be compared, sorted. If one of the two lost more of the case's runs, the difference is
  /// infinite, on the side that is worse for the one that lost more. Else it is the mean over the runs that both have.
  std::vector<double> values;
  /// The mean differences of all cases with runs that both have, whoever lost others; sorted.
  std::vector<double> of_both;
  Tally runs, cases;
};

/// A case in which both lost equally many runs, and have none in common, says nothing and is left out.
///
/// Rounding noise decides nothing. The noise of a difference is a billionth (1e-9) of the largest magnitude among the
/// values that it was made from. A difference within its noise of 0 is 0. Then, from the least noise to the most, one
/// whose magnitude is within its noise of another magnitude takes that one. So ties and zeros, and with them p, do not
/// depend on the unit of the values or on whether a double can hold them.
///
/// The order of the pairs makes no difference, to the last bit. Throws Error for a value that is not finite.
CaseDifferences case_differences(const std::vector<Pair>& pairs, bool larger_is_better);

/// Median of sorted differences, of which some may be infinite. Between two infinite ones of different sign, it is 0.
/// Throws Error for none.
double median_of_differences(const std::vector<double>& sorted);

enum class SignedRankMethod { automatic, exact, normal };

struct SignedRank {
  std::size_t cases = 0;      ///< number of cases, including the zeros
  std::size_t zeros = 0;      ///< differences of exactly 0
  double positive_ranks = 0;  ///< sum of the ranks of the positive differences
  double negative_ranks = 0;  ///< sum of the ranks of the negative differences
  double p = 1;               ///< two-sided
  bool exact = true;          ///< p is from the exact distribution, not from its normal approximation
};

/// Two-sided Wilcoxon signed-rank test of the hypothesis that the differences scatter symmetrically around 0 (Wilcoxon
/// 1945, Biometrics Bull 1:80). `differences` holds ONE value per case (case_differences); infinite ones share the
/// highest rank. Magnitudes that differ by less than a billionth of themselves are equal and share their mean rank.
/// Zeros are ranked with the others and then left out (Pratt 1959, J Am Stat Assoc 54:655). If they are left out before
/// the ranking, as Wilcoxon did, the evidence can become stronger when a difference becomes smaller.
///
/// - exact: counts all 2^n assignments of signs to the given ranks, including ties and zeros (dynamic programming over
///   twice the ranks, which are integers). Without ties and zeros, this is the usual table.
/// - normal: normal approximation with the variance corrected for zeros (Pratt) and ties (Cureton 1967, J Am Stat Assoc
///   62:1068), and with continuity correction.
/// - automatic: exact up to 50 differences that are not 0, else normal. Ties are no reason for the approximation: it
///   would give five equal differences p = 0.037, but 0.0625 is the least that five cases can reach.
///
/// p = 1 if all differences are 0. Throws Error for no differences, NaN, or exact with more than 50 that are not 0.
SignedRank signed_rank_test(const std::vector<double>& differences,
                            SignedRankMethod method = SignedRankMethod::automatic);

/// A variant compared with the reference on one metric.
struct Comparison {
  Tally runs, cases;
  double median_difference = 0;   ///< median_of_differences; positive if the variant's value is larger; may be infinite
  Interval interval;              ///< order_statistic_interval (bootstrap.hpp) of the differences
  std::size_t cases_of_both = 0;  ///< cases with runs that both have, whoever lost others
  std::optional<double> median_of_both;  ///< median over these; nothing without any
  SignedRank test;
  /// The side on which failures alone put the difference: that of the one that lost more runs in more cases, if a sign
  /// test over the cases in which one lost more shows it at 1 - confidence. 1: variant - reference is positive. 0: no
  /// side is shown.
  int side_of_failures = 0;
  /// Cases with a difference. 0: nothing is known, so p is 1 and the interval infinite.
  std::size_t compared() const { return cases.all() - cases.neither; }
};

/// Throws Error as case_differences() does, or for a confidence that is not between 0 and 1.
Comparison compare_pairs(const std::vector<Pair>& pairs, bool larger_is_better, double confidence = 0.95);

/// Whether a difference counts as shown: p (after Holm) < alpha, and the median's interval does not contain 0 and lies
/// on the side to which the ranks point, or the failures are on this side (side_of_failures): a variant that loses 20
/// of 30 cases is worse, although the 10 others leave the median open. The test judges ranks, but the sentence reports
/// the median. If the two contradict each other (many cases slightly better, some much worse), there is no finding; nor
/// is there one if the differences are skewed with a median of 0, which the test alone would take for a difference. The
/// comparison's confidence is 1 - alpha. Throws Error for a p that is not within 0 to 1.
bool difference_shown(const Comparison& comparison, double p_after_holm, double alpha = 0.05);

/// The fewest cases with which one of so many comparisons can reach p < alpha after Holm, all having as many cases: the
/// smallest n with comparisons * 2^(1 - n) < alpha. 6 for one at 0.05, and 9 for ten. Throws Error for an alpha that is
/// not between 0 and 1, or for no comparisons.
std::size_t fewest_cases(double alpha = 0.05, std::size_t comparisons = 1);

struct Metric {
  std::string label;  ///< "target error"; may be empty
  std::string unit;   ///< "mm"; may be empty
  bool larger_is_better = false;
};

/// p after Holm's correction, and how many comparisons it corrects for.
struct CorrectedP {
  double p = 1;
  std::size_t comparisons = 1;
};

/// The result of a comparison in words:
/// "canny, target error: 0.12 mm worse, 95 % interval 0.08 to 0.17, 20 cases, p < 0.001"
/// "canny, target error: no difference shown: 0.01 mm worse, 95 % interval 0.03 mm better to 0.05 mm worse,
/// 20 cases, p = 0.62"
/// Bounds without a word are in the direction that the sentence names. It is the interval of this comparison alone;
/// only p is corrected for the number of comparisons. With too few cases to reach alpha, the sentence says how many it
/// takes. With too few for an interval, it gives none. The last digit shown is worth at most a quarter of the
/// interval's width.
///
/// If runs failed, the sentence says so, how many cases are compared, and what an infinite bound means:
/// "canny, target error: 0.12 mm worse, 95 % interval 0.08 mm to a failure of canny, 20 of 22 cases, p = 0.0031; of 22
/// runs, only canny failed in 3, only the baseline in 0, both in 2"
/// If the median itself is a failure, that comes first:
/// "canny, target error: fails more often than the baseline, in 22 of 30 cases, p < 0.001; of 30 runs, only canny
/// failed in 22, only the baseline in 0, both in 0; where both have a value, in 8 cases, the median is 0.20 mm better"
/// If no difference is shown although p < alpha, it says why: the interval contains 0, or the ranks point to the other
/// side. If `reference` is not empty, it stands for "the baseline" in all of this, and the sentence begins
/// "canny against sobel, target error". Throws Error as difference_shown() does.
std::string sentence(const std::string& variant, const Metric& metric, const Comparison& comparison,
                     const CorrectedP& corrected, double alpha = 0.05, const std::string& reference = "");

/// The same of a comparison that is not tested, such as the effect of a factor: without p, and without saying whether a
/// difference is shown. `variant` and `reference` are the two levels.
/// "powell against nelder_mead, target error: 0.12 mm worse, 95 % interval 0.08 to 0.17, 20 cases"
std::string effect_sentence(const std::string& variant, const std::string& reference, const Metric& metric,
                            const Comparison& comparison);

}  // namespace compare

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

// How many cases a difference takes, planned from the cases that there are.
