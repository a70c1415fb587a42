// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

// The statistics behind a comparison of variants on the same cases. Values are in the metric's own unit (mm, deg, px,
// s). Nothing is left out silently: a value that is not finite throws Error, so the caller decides what a failed run
// counts as.
namespace marrow::compare {

struct Interval {
  double lower = 0;
  double upper = 0;
  double confidence = 0.95;
};

/// Interval of a success rate (0 to 1) after `successes` of `trials`: the score interval without continuity correction
/// (Wilson 1927, J Am Stat Assoc 22:209; Brown, Cai and DasGupta 2001, Stat Sci 16:101, Eq 4). It stays within 0 to 1
/// and is of use at 0 and at all successes too. Throws Error for no trials, more successes than trials, or a confidence
/// that is not between 0 and 1.
Interval wilson_interval(std::size_t successes, std::size_t trials, double confidence = 0.95);

/// Quantiles interpolate linearly between the sorted values, at position fraction * (count - 1) counted from 0 (type 7
/// of Hyndman and Fan 1996, Am Stat 50:361; numpy's and R's default).
struct Summary {
  std::size_t count = 0;
  double mean = 0;
  double median = 0;
  double lower_quartile = 0;
  double upper_quartile = 0;
  double percentile_95 = 0;  ///< the value that 95 % are as good as; the 5th percentile where higher is better
  double worst = 0;
};

/// Throws Error for no values, or one that is not finite.
Summary summarise(const std::vector<double>& values, bool higher_is_better = false);

/// How far from the truth a run began, and how it ended.
struct StartOutcome {
  double error = 0;  ///< of the start, as an mTRE in mm
  bool success = false;
};

/// Success over the start's error, in bins of equal width from 0 to the farthest start; of 100 bins the last holds all
/// beyond.
struct CaptureRange {
  struct Bin {
    double from = 0, to = 0;  ///< from <= error < to
    std::size_t successes = 0, runs = 0;
    Interval success;  ///< wilson_interval; 0 to 1 of no runs
  };
  std::vector<Bin> bins;
  /// Up to here each bin that holds runs has at least the rate that is asked for: the upper end of the last bin before
  /// the first that has not; where there is none such, the farthest start. 0 where the first bin that holds runs fails.
  double range = 0;
  bool is_open = false;  ///< no bin fails: with starts from farther away it may come out larger
};

/// The capture range of van de Kraats et al. (IEEE Trans Med Imaging 2005, 24:1177). The rate counts, not its interval:
/// a bin of 10 successes in 10 runs reaches 95 %, though its interval begins at 72 %. Bins of no runs say nothing and
/// are passed over. Throws Error for an error that is negative or not finite, a width that is not positive, or a rate
/// not within 0 to 1.
CaptureRange capture_range(const std::vector<StartOutcome>& outcomes, double bin_width = 2, double least_rate = 0.95);

/// A metric of two variants that ran on the same case from the same start (or seed). A case may have several pairs.
struct Pair {
  std::string case_name;
  double reference = 0;
  double variant = 0;
};

/// One difference (variant - reference) per case, the mean over the case's pairs, sorted by value. Starts of one case
/// share its CT and views, so they are no independent evidence; after this, a case counts once however many starts it
/// had. The order of the pairs makes no difference, to the last bit. Throws Error for no pairs or a value that is not
/// finite.
std::vector<double> case_differences(const std::vector<Pair>& pairs);

/// Interval of the median difference over cases: percentile bootstrap (Efron and Tibshirani 1993, An Introduction to
/// the Bootstrap, Eq 13.5). `differences` holds ONE value per case (case_differences), so that each resample draws
/// whole cases: it is the cluster bootstrap. The bounds are type 7 quantiles of the resamples' medians.
///
/// Median, since errors of registration have long tails: one lost case of 30 mm among errors of 0.3 mm would be the
/// mean. Percentile and not BCa, since BCa's acceleration comes from the jackknife, which fails for a median
/// (ibid, 11.6).
///
/// The same differences (in any order), seed and counts give the same bytes on any machine: own generator (SplitMix64,
/// Steele, Lea and Flood 2014, OOPSLA) and nothing but comparisons, additions and multiplications of doubles.
///
/// Of simulated differences (normal, and with a tenth of tenfold spread) the 95 % interval holds the true median in 92
/// to 94 % with 6 to 20 cases, in 94 to 95 % with 30 to 100. Below 6 cases even the range from the smallest to the
/// largest difference holds the true median in less than 95 % (its chance is 1 - 2^(1 - cases)), so the interval is too
/// narrow; of one case it has no width.
///
/// Throws Error for no differences, one that is not finite, a confidence not between 0 and 1, or fewer than 1000
/// resamples.
Interval median_interval(const std::vector<double>& differences, std::uint64_t seed, double confidence = 0.95,
                         std::size_t resamples = 10000);

enum class SignedRankMethod { automatic, exact, normal };

struct SignedRank {
  std::size_t cases = 0;      ///< with the zeros
  std::size_t zeros = 0;      ///< differences of exactly 0
  double positive_ranks = 0;  ///< sum of the ranks of the positive differences
  double negative_ranks = 0;  ///< sum of the ranks of the negative differences
  double p = 1;               ///< two-sided
  bool exact = true;          ///< the exact distribution, or its normal approximation
};

/// Wilcoxon signed-rank test, two-sided, of differences that scatter symmetrically around 0 (Wilcoxon 1945, Biometrics
/// Bull 1:80). `differences` holds ONE value per case (case_differences). Equal magnitudes share their mean rank; equal
/// means equal to the last bit. Zeros take part in the ranking and are then left out (Pratt 1959, J Am Stat Assoc
/// 54:655): leaving them out before, as Wilcoxon did, can make the evidence stronger when a difference goes down.
///
/// - exact: all 2^n assignments of signs to the ranks as they are, ties and zeros included (dynamic programming over
///   twice the ranks, which are integers). Without ties and zeros it is the usual table.
/// - normal: with Pratt's and the tie's corrected variance (Cureton 1967, J Am Stat Assoc 62:1068) and continuity
///   correction.
/// - automatic: exact up to 50 differences that are not 0, else normal. Ties do not call for the approximation, which
///   would give five equal differences p = 0.037 where 0.0625 is the least that five cases can reach.
///
/// p = 1 when all are 0. Throws Error for no differences, one that is not finite, or exact with more than 50 that are
/// not 0.
SignedRank signed_rank_test(const std::vector<double>& differences,
                            SignedRankMethod method = SignedRankMethod::automatic);

/// p-values after Holm's correction (Holm 1979, Scand J Stat 6:65), in the order given: compared with alpha, they keep
/// the chance of one or more false findings in the whole list within alpha. Throws Error for a p that is not within 0
/// to 1.
std::vector<double> holm(const std::vector<double>& p_values);

/// A variant against the reference on one metric.
struct Comparison {
  std::size_t cases = 0;
  std::size_t pairs = 0;
  double median_difference = 0;  ///< over cases, of case_differences; positive = the variant's value is larger
  Interval interval;             ///< median_interval
  SignedRank test;
};

Comparison compare_pairs(const std::vector<Pair>& pairs, std::uint64_t seed, double confidence = 0.95);

/// A difference counts as shown when p (after Holm) < alpha and the median's interval lies, without 0, on the side that
/// the ranks lean to. The test judges ranks and the sentence speaks of the median: where they contradict each other
/// (many cases slightly better, some much worse), neither is a finding. Throws Error for a p not within 0 to 1 or an
/// alpha not within 0.001 to below 1.
bool difference_shown(const Comparison& comparison, double p_after_holm, double alpha = 0.05);

/// The fewest cases with which the signed-rank test can reach p < alpha: smallest n with 2^(1 - n) < alpha; 6 for 0.05.
std::size_t fewest_cases(double alpha = 0.05);

struct Metric {
  std::string label;  ///< "target error"; may be empty
  std::string unit;   ///< "mm"; may be empty
  bool larger_is_better = false;
};

/// "canny, target error: 0.12 mm worse, 95 % interval 0.08 to 0.17, 20 cases, p < 0.001"
/// "canny, target error: no difference shown: 0.01 mm worse, 95 % interval -0.03 to 0.05, 20 cases, p = 0.62"
/// The interval counts in the direction named, so for "0.01 mm better" a negative bound is worse. It is the interval of
/// this comparison alone; only p is corrected for their number. Below fewest_cases(alpha) the sentence says so and has
/// no interval. Digits: the last place is at most a quarter of the interval's width. Throws Error as difference_shown
/// does.
std::string sentence(const std::string& variant, const Metric& metric, const Comparison& comparison,
                     double p_after_holm, double alpha = 0.05);

}  // namespace marrow::compare
