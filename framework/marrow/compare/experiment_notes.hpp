// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <string>
#include <vector>

#include "marrow/base/export.hpp"
#include "marrow/compare/experiment.hpp"

namespace MARROW_EXPORT marrow {
namespace compare {

/// The comparisons that an experiment makes: one for each figure of each variant beside the baseline, or of each pair
/// with 'compare_all'. If an optimizer chooses options, the tuned variant is another one, and only the cases that are
/// held out count.
struct ComparisonCounts {
  std::size_t comparisons = 0, cases = 0;
  /// The fewest cases with which one of them can reach p < 0.05 (fewest_cases); 0 without comparisons.
  std::size_t fewest_cases = 0;
};
ComparisonCounts comparison_counts(const Experiment& experiment);

/// What an experiment cannot show although it can run, in sentences: differences with too few cases, a rule under
/// 'stop' that can never be met, a capture range without success. It takes some milliseconds for each look of the rule.
std::vector<std::string> notes_of(const Experiment& experiment);

}  // namespace compare
}  // namespace marrow
