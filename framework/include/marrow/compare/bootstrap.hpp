// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <cstddef>
#include <cstdint>
#include <vector>

#include "marrow/compare/statistics.hpp"

// Intervals of medians where a case has several runs. Each resample draws cases and then, within each drawn case, as
// many of its runs as it has: the hierarchical bootstrap (Davison and Hinkley 1997, Bootstrap Methods and their
// Application, section 3.8; Saravanan, Berman and Sober 2020, Neurons Behav Data Anal Theory 3:1). The bounds are type
// 7 quantiles of the resamples' medians (percentile method).
//
// With simulated runs (normal, and t with 3 degrees of freedom; intra-class correlations of 0 to 0.9; 10 to 50 cases
// with 5 or 10 runs), the 95 % interval of the median of all runs holds the true median in 93 to 99 % of the trials. It
// is too wide if the runs of a case do not correlate, because both draws then add the same scatter. If only cases were
// drawn, the interval would hold the median in 89 to 96 %: too few.
//
// The same values (cases and runs in any order), seed and counts give the same bytes with any number of threads.
// Resample k has random numbers of its own, Random(seed, k).
//
// All functions throw Error for no cases, a case without values, a value that is not finite, a confidence that is not
// between 0 and 1, or fewer than 1000 resamples.
namespace marrow::compare {

/// For each case the values of its runs.
using ValuesOfCases = std::vector<std::vector<double>>;

struct BootstrapSettings {
  std::uint64_t seed = 1;
  double confidence = 0.95;
  std::size_t resamples = 10000;
  int threads = 0;  ///< 0 = as many as the machine has cores
};

/// Resamples that take seconds: 10,000 for up to 100,000 runs, and fewer for more, but never below 1000.
std::size_t resamples_for(std::size_t runs);

/// Interval of the median of all values.
Interval median_of_runs_interval(const ValuesOfCases& cases, const BootstrapSettings& settings = {});

/// Interval of the median over cases of the mean of each case's values. If each case has one value, it is
/// median_interval() (statistics.hpp), to the last bit.
Interval median_of_case_means_interval(const ValuesOfCases& cases, const BootstrapSettings& settings = {});

}  // namespace marrow::compare
