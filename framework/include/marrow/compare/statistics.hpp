// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

// The statistics behind a comparison of variants on the same cases. Values are in the metric's own unit (mm, deg, px,
// s). No value is left out silently: one that is not finite throws Error, so the caller decides how a failed run
// counts.
namespace marrow::compare {

struct Interval {
  double lower = 0;
  double upper = 0;
  double confidence = 0.95;
};

/// Interval of a success rate (0 to 1) after `successes` of `trials`: the score interval without continuity correction
/// (Wilson 1927, J Am Stat Assoc 22:209; Brown, Cai and DasGupta 2001, Stat Sci 16:101, Eq 4). It stays within 0 to 1
/// and is useful even with no successes or with all. Throws Error for no trials, more successes than trials, or a
/// confidence that is not between 0 and 1.
Interval wilson_interval(std::size_t successes, std::size_t trials, double confidence = 0.95);

/// Quantiles interpolate linearly between the sorted values, at position fraction * (count - 1), counted from 0 (type 7
/// of Hyndman and Fan 1996, Am Stat 50:361; the default of numpy and R).
struct Summary {
  std::size_t count = 0;
  double mean = 0;
  double median = 0;
  double lower_quartile = 0;
  double upper_quartile = 0;
  double percentile_95 = 0;  ///< 95 % of the values are as good or better; the 5th percentile if higher is better
  double worst = 0;
};

/// Throws Error for no values, or for one that is not finite.
Summary summarise(const std::vector<double>& values, bool higher_is_better = false);

/// How far from the truth a run began, and how it ended.
struct StartOutcome {
  double error = 0;  ///< error of the start, an mTRE in mm
  bool success = false;
  std::string case_name = {};  ///< runs with the same one are not independent; empty: a case of its own
};

/// Success rate over the error of the start, in bins of equal width from 0 to the farthest start. There are at most 100
/// bins; the last one holds all starts beyond.
struct CaptureRange {
  struct Bin {
    double from = 0, to = 0;  ///< from <= error < to
    std::size_t successes = 0, runs = 0;
    Interval success;  ///< CaseRate::interval; 0 to 1 if there are no runs
  };
  std::vector<Bin> bins;
  /// Up to this error, each bin with runs has at least the required rate. It is the upper end of the last bin with runs
  /// before the first bin that fails. If no bin fails, it is the error of the farthest start. 0 if the first bin with
  /// runs fails.
  double range = 0;
  bool is_open = false;  ///< no bin fails: starts from farther away might give a larger range
};

/// The capture range of van de Kraats et al. (IEEE Trans Med Imaging 2005, 24:1177). The rate itself counts, not its
/// interval: a bin with 10 successes in 10 runs reaches 95 %, although its interval begins at 72 %. Bins without runs
/// are skipped. Throws Error for a start error that is negative or not finite, a bin width that is not positive, or a
/// rate not within 0 to 1.
CaptureRange capture_range(const std::vector<StartOutcome>& outcomes, double bin_width = 2, double least_rate = 0.95);

/// The values of a metric for two variants that ran on the same case from the same start (or seed). A case may have
/// several pairs.
struct Pair {
  std::string case_name;
  double reference = 0;
  double variant = 0;
};

/// One difference (variant - reference) per case, which is the mean over the case's pairs. The differences are sorted
/// by value. Starts of one case share its CT and views, so they are not independent evidence. With the mean, a case
/// counts once, however many starts it has. The order of the pairs makes no difference, to the last bit. Throws Error
/// for no pairs or a value that is not finite.
std::vector<double> case_differences(const std::vector<Pair>& pairs);

/// Interval of the median difference over cases: percentile bootstrap (Efron and Tibshirani 1993, An Introduction to
/// the Bootstrap, Eq 13.5). `differences` holds ONE value per case (case_differences), so each resample draws whole
/// cases: this is the cluster bootstrap. The bounds are type 7 quantiles of the resamples' medians.
///
/// The median is used because errors of registration have long tails: one lost case of 30 mm among errors of 0.3 mm
/// would dominate the mean. The percentile method is used and not BCa, because BCa's acceleration comes from the
/// jackknife, which fails for a median (ibid, 11.6).
///
/// The same differences (in any order), seed and counts give the same bytes on any machine. The code has its own random
/// generator (SplitMix64, Steele, Lea and Flood 2014, OOPSLA), and uses only comparisons, additions and multiplications
/// of doubles.
///
/// With simulated differences (normal, and with a tenth of tenfold spread), the 95 % interval holds the true median in
/// 92 to 94 % of the trials with 6 to 20 cases, and in 94 to 95 % with 30 to 100 cases. With fewer than 6 cases, even
/// the range from the smallest to the largest difference holds the true median with a probability below 95 % (it is 1 -
/// 2^(1 - cases)). So the interval is then too narrow; with one case it has no width.
///
/// Throws Error for no differences, one that is not finite, a confidence not between 0 and 1, or fewer than 1000
/// resamples.
Interval median_interval(const std::vector<double>& differences, std::uint64_t seed, double confidence = 0.95,
                         std::size_t resamples = 10000);

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
/// 1945, Biometrics Bull 1:80). `differences` holds ONE value per case (case_differences). Equal magnitudes share their
/// mean rank; equal means equal to the last bit. Zeros are ranked with the others and then left out (Pratt 1959, J Am
/// Stat Assoc 54:655). If they are left out before the ranking, as Wilcoxon did, the evidence can become stronger when
/// a difference becomes smaller.
///
/// - exact: counts all 2^n assignments of signs to the given ranks, including ties and zeros (dynamic programming over
///   twice the ranks, which are integers). Without ties and zeros, this is the usual table.
/// - normal: normal approximation with the variance corrected for zeros (Pratt) and ties (Cureton 1967, J Am Stat Assoc
///   62:1068), and with continuity correction.
/// - automatic: exact up to 50 differences that are not 0, else normal. Ties are no reason for the approximation: it
///   would give five equal differences p = 0.037, but 0.0625 is the least that five cases can reach.
///
/// p = 1 if all differences are 0. Throws Error for no differences, one that is not finite, or exact with more than 50
/// that are not 0.
SignedRank signed_rank_test(const std::vector<double>& differences,
                            SignedRankMethod method = SignedRankMethod::automatic);

/// p-values after Holm's correction (Holm 1979, Scand J Stat 6:65), in the given order. If they are compared with
/// alpha, the probability of one or more false findings in the whole list is at most alpha. Throws Error for a p that
/// is not within 0 to 1.
std::vector<double> holm(const std::vector<double>& p_values);

/// A variant compared with the reference on one metric.
struct Comparison {
  std::size_t cases = 0;
  std::size_t pairs = 0;
  double median_difference = 0;  ///< median of case_differences; positive if the variant's value is larger
  Interval interval;             ///< median_of_case_means_interval (bootstrap.hpp) of the differences
  SignedRank test;
};

/// Throws Error as case_differences() and median_interval() do.
Comparison compare_pairs(const std::vector<Pair>& pairs, std::uint64_t seed, double confidence = 0.95);

/// Whether a difference counts as shown: there are at least fewest_cases(alpha) cases, p (after Holm) < alpha, and the
/// median's interval does not contain 0 and lies on the side to which the ranks point. The test judges ranks, but the
/// sentence reports the median. If the two contradict each other (many cases slightly better, some much worse), there
/// is no finding. Throws Error for a p not within 0 to 1, or an alpha not within 0.001 to below 1.
bool difference_shown(const Comparison& comparison, double p_after_holm, double alpha = 0.05);

/// The fewest cases with which the signed-rank test can reach p < alpha: the smallest n with 2^(1 - n) < alpha; 6 for
/// 0.05. Throws Error for an alpha not within 0.001 to below 1.
std::size_t fewest_cases(double alpha = 0.05);

struct Metric {
  std::string label;  ///< "target error"; may be empty
  std::string unit;   ///< "mm"; may be empty
  bool larger_is_better = false;
};

/// The result of a comparison in words:
/// "canny, target error: 0.12 mm worse, 95 % interval 0.08 to 0.17, 20 cases, p < 0.001"
/// "canny, target error: no difference shown: 0.01 mm worse, 95 % interval -0.03 to 0.05, 20 cases, p = 0.62"
/// The interval is given in the direction that the sentence names, so for "0.01 mm better" a negative bound is worse.
/// It is the interval of this comparison alone; only p is corrected for the number of comparisons. With fewer than
/// fewest_cases(alpha) cases, the sentence says so and has no interval. The last digit that is shown is worth at most a
/// quarter of the interval's width. Throws Error as difference_shown() does.
std::string sentence(const std::string& variant, const Metric& metric, const Comparison& comparison,
                     double p_after_holm, double alpha = 0.05);

}  // namespace marrow::compare
