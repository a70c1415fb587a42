// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <cstddef>
#include <string>
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
}  // namespace marrow
