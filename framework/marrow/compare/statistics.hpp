// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <cstddef>
#include <limits>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "marrow/base/export.hpp"

// The statistics behind a comparison of variants on the same cases. Values are in the metric's own unit (mm, deg, px,
// s). No value is left out silently: one that is not finite throws Error, so the caller decides how a failed run
// counts.
namespace MARROW_EXPORT marrow {
namespace compare {

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

/// p-values after Holm's correction (Holm 1979, Scand J Stat 6:65), in the given order. If they are compared with
/// alpha, the probability of one or more false findings in the whole list is at most alpha. Throws Error for a p that
/// is not within 0 to 1.
std::vector<double> holm(const std::vector<double>& p_values);

}  // namespace compare

namespace compare {

/// Groups of a ranking as letters (the compact letter display; Piepho 2004, J Comput Graph Stat 13:456): two things
/// share a letter if and only if no test tells them apart. `different` holds the pairs that a test tells apart. The
/// first thing has "a", and letters follow in the order of the first thing that has them.
///
/// Groups are the largest sets of which no pair differs. Nothing if there are more of them than letters, which is so
/// only if many pairs differ in a pattern that is no order. Throws Error for a pair that names a thing that is not
/// there, or one thing twice.
std::optional<std::vector<std::string>> letters_of_groups(
    std::size_t things, const std::vector<std::pair<std::size_t, std::size_t>>& different);

}  // namespace compare

}  // namespace marrow

namespace marrow::compare {

// The beta, Student's and the normal distribution by Boost.Math, under the names that the statistics use, and the
// interval that follows from the normal one.

/// A difference that a failure makes, or a bound that too few cases leave open.
inline constexpr double kInfinite = std::numeric_limits<double>::infinity();

/// I_x(a, b), the regularized incomplete beta function (Olver et al. 2010, NIST Handbook of Mathematical Functions,
/// section 8.17). a and b are positive. For whole k < n, it is the probability of at most k heads in n throws of a fair
/// coin with a = n - k, b = k + 1 and x = 0.5.
double incomplete_beta(double a, double b, double x);

/// The x with I_x(a, b) = p. p is between 0 and 1.
double beta_quantile(double p, double a, double b);

/// The t for which Student's t with `freedom` degrees of freedom is farther from 0 with the probability `outside`.
double student_quantile(double outside, double freedom);

/// Probability that a standard normal variable is larger than z.
double upper_tail(double z);

/// The z with upper_tail(z) = tail; 40 for a tail too small for a double.
double z_of_tail(double tail);

/// Wilson's interval of a rate that was seen in `runs` independent runs, which need not be a whole number.
Interval score_interval(double rate, double runs, double confidence);

// Checks of the values and settings of quantiles and their intervals.

/// Throws Error for no values, or for one that is not finite. `what` is the word for one value in the message.
void check_finite(const std::vector<double>& values, const std::string& what);
/// The same, but values may be infinite.
void check_numbers(const std::vector<double>& values, const std::string& what);
/// Throws Error for a confidence that is not between 0 and 1.
void check_confidence(double confidence);
/// Throws Error if there are too few for bounds.
void check_resamples(std::size_t resamples);

}  // namespace marrow::compare
