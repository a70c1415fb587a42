// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <cstddef>
#include <map>
#include <string>

#include "marrow/compare/statistics.hpp"

namespace MARROW_EXPORT marrow {
namespace compare {

/// A success rate over runs of which several may share a case. Such runs are not independent: if one start of a case
/// fails, its other starts are more likely to fail too. So 20 cases with 10 starts each tell less about a method than
/// 200 cases.
class CaseRate {
 public:
  void add(const std::string& case_name, bool is_success);

  std::size_t runs() const { return runs_; }
  std::size_t successes() const { return successes_; }

  /// The number of independent runs whose rate would be as uncertain as this one: runs() divided by the design effect
  /// (Rao and Scott 1992, Biometrics 48:577). The design effect is the variance of the rate between cases over the
  /// variance that independent runs would have. It is at least 1. It is at most what it is if all runs of a case end
  /// alike, so there are never fewer effective runs than cases if all cases have equally many runs. With one run in
  /// each case, it is runs().
  ///
  /// Few cases may agree by chance: with no failure, or a single one, they show nothing about how the runs of a case
  /// agree. So the variance is taken with two more cases of a quarter of a case's weight, one in which all runs
  /// succeed and one in which none does. With nothing else known, they say that the runs of a case end alike. So 23 of
  /// 24 runs, 3 in each of 8 cases, are worth 11.9 runs. Without the two cases they would be worth 23, and intervals of
  /// 8 cases would hold the true rate in as few as 41 % of simulated trials (docs/comparing.md has the table).
  ///
  /// Throws Error without runs.
  double effective_runs() const;

  /// Wilson's interval (statistics.hpp) of the rate with effective_runs(). With one run in each case, it is
  /// wilson_interval, to the last bit.
  ///
  /// In simulations with an intra-class correlation of 0.5, rates of 0.5 to 0.95, and 10 to 100 cases with 5 or 10 runs
  /// each, the 95 % interval holds the true rate in 94 to 98 % of the trials; Wilson's interval of all runs does in 58
  /// to 87 %. With independent runs, it is too wide (96 to 99.5 %).
  ///
  /// Like Wilson's own, it holds the confidence on average over the rates. For some rates near 0 or 1, it does not: at
  /// 0.98, the 95 % interval of 10 independent runs holds it in 84 % of the trials.
  ///
  /// Throws Error without runs, or for a confidence that is not between 0 and 1.
  Interval interval(double confidence = 0.95) const;

  /// An interval that holds every rate with at least this confidence, if runs are independent: Clopper and Pearson 1934
  /// (Biometrika 26:404), with effective_runs() where they are not (Korn and Graubard 1998, Surv Methodol 24:193). It
  /// is wider than interval(). Rules that stop when an interval is narrow need it, because they choose narrow ones, and
  /// because Wilson's interval falls short of a high confidence: its 99 % interval of 3 runs holds some rates in 88 %.
  /// Throws Error as interval() does.
  Interval exact_interval(double confidence) const;

 private:
  struct Counts {
    std::size_t successes = 0, runs = 0;
  };
  std::map<std::string, Counts> cases_;
  std::size_t runs_ = 0, successes_ = 0;
};

}  // namespace compare
}  // namespace marrow
