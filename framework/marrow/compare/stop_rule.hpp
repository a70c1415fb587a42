// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <cstddef>
#include <optional>
#include <string>
#include <vector>

#include "marrow/compare/paired.hpp"

namespace MARROW_EXPORT marrow {
namespace compare {

// Tests that are repeated while cases are added. With twenty looks at p < 0.05, a quarter of the experiments without a
// difference would show one. Here all looks together show one in at most alpha of them.

/// How alpha is spent over the looks (Lan and DeMets 1983, Biometrika 70:659).
enum class Spending {
  /// Up to the share t, 4 - 4 Phi(z / sqrt t) with Phi(z) = 1 - alpha / 4. Early looks get almost nothing, and the last
  /// one loses little. Close to the bounds of O'Brien and Fleming 1979, Biometrics 35:549.
  late,
  /// Up to the share t, alpha ln(1 + (e - 1) t). All looks get about the same level. Close to the bounds of Pocock
  /// 1977.
  even
};

/// For each look, the two-sided p below which it shows a difference. `information` is the share of the planned
/// cases that each look has seen, rising, up to 1 at most.
///
/// The levels come from the joint distribution of the looks by numerical integration (Armitage, McPherson and Rowe
/// 1969, J R Stat Soc A 132:235). The looks are taken for sums of independent parts, which holds for Wilcoxon's
/// signed-rank test with many cases. With few cases, its exact p is discrete, and the test shows less than alpha.
///
/// Looks at other shares than planned are allowed, as long as their shares do not depend on what was seen. Throws Error
/// for no looks, shares that do not rise from above 0 to at most 1, or an alpha not within 0.001 to 0.5.
std::vector<double> levels_of_looks(const std::vector<double>& information, double alpha = 0.05,
                                    Spending spending = Spending::late);

/// The numbers of cases at which one looks: `first`, then `every` more each time, and `most` at the end. Throws Error
/// if one of them is 0, or `most` is below `first`.
std::vector<std::size_t> looks_at(std::size_t first, std::size_t every, std::size_t most);

/// When a comparison that takes more and more cases ends.
struct StopRule {
  enum class Goal {
    width,      ///< an interval is narrow enough, for each variant
    difference  ///< a variant differs from the baseline
  };
  Goal goal = Goal::width;
  std::optional<std::size_t> metric;  ///< number of the metric; nothing for the success rate
  double width = 0;                   ///< of the interval, which has the confidence 1 - alpha over all looks
  std::size_t variant = 0;            ///< compared with the baseline
  double alpha = 0.05;                ///< over all looks together
  std::size_t first_cases = 0;        ///< the experiment's own cases: the first look is at them
  std::size_t look_every = 0;         ///< cases from one look to the next
  std::size_t most_cases = 0;         ///< the last look

  /// The numbers of cases at which one looks (looks_at).
  std::vector<std::size_t> looks() const;
};

/// What alpha leaves to each look of a rule (levels_of_looks): differences are tested late, widths at all looks alike.
/// The share of a look is its cases over the most cases, also where some of them failed. To make it takes some
/// milliseconds for each look.
class StopPlan {
 public:
  explicit StopPlan(const StopRule& rule);
  const StopRule& rule() const { return rule_; }
  const std::vector<std::size_t>& looks() const { return looks_; }
  /// Throws Error if there is no look at this number of cases.
  double level_at(std::size_t cases) const { return levels_[number_of(cases)]; }
  /// The number of the look, counted from 0. Throws Error if there is no look at this number of cases.
  std::size_t number_of(std::size_t cases) const;

 private:
  StopRule rule_;
  std::vector<std::size_t> looks_;
  std::vector<double> levels_;
};

/// What was found at one look.
struct Look {
  std::size_t number = 0;  ///< counted from 1
  std::size_t looks = 0, cases = 0;
  double level = 0;         ///< StopPlan::level_at
  bool is_met = false;      ///< the rule says stop
  std::size_t variant = 0;  ///< whose interval this is: the widest one, or that of the rule's variant
  /// With the confidence 1 - alpha, it and those of all other looks hold the true value (repeated intervals: Jennison
  /// and Turnbull 1989, J R Stat Soc B 51:305). So it may be read after any look. Infinite if there are too few cases.
  Interval interval;
  double p = 1;           ///< goal difference: Wilcoxon's, two-sided
  double difference = 0;  ///< goal difference: median over cases; infinite if it is a failure

  double width() const { return interval.upper - interval.lower; }
  bool is_last() const { return number == looks; }
};

/// Looks at the intervals of all variants, in their order, each with the confidence 1 - plan.level_at(cases). The
/// widest one decides. A variant without an interval is not narrow enough.
///
/// Whoever stops as soon as the usual 95 % interval is narrow chooses one that is narrow by chance. In simulations with
/// a look at every 20 of up to 400 cases, such an interval of a median held the true one in 94 to 95 % of the trials,
/// and in 96 % at a fixed number of cases. An interval at the look's own confidence is wider; it comes from
/// median_interval_of() or CaseRate::exact_interval().
///
/// Throws Error as level_at() does, or for no variants.
Look look_at_widths(const StopPlan& plan, std::size_t cases, const std::vector<std::optional<Interval>>& intervals);

/// Looks at the differences of pairs, with the answer's own definition: difference_shown() at the level of the look, on
/// compare_pairs() with the confidence 1 - level. So neither skewed differences with a median of 0 nor too few cases
/// end a comparison. If the level is 0 in double precision, no difference is shown. Throws Error as level_at() and
/// case_differences() do.
Look look_at_difference(const StopPlan& plan, std::size_t cases, const std::vector<Pair>& pairs, bool larger_is_better);

/// What a look is about, in words.
struct LookNames {
  std::string figure;   ///< the metric's label, or "the success rate"
  std::string unit;     ///< may be empty
  std::string variant;  ///< of Look::variant
  std::string baseline;
};
std::string sentence(const StopRule& rule, const Look& look, const LookNames& names);

}  // namespace compare
}  // namespace marrow
