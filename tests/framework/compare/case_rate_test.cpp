// SPDX-License-Identifier: Apache-2.0
#include <marrow/compare/case_rate.hpp>
#include <marrow/domain/random.hpp>

#include "tests/framework/compare/intervals.hpp"
#include "tests/harness/message_of.hpp"

namespace case_rate_test {

using namespace marrow::compare;
using intervals::bounds;

/// In the first `failing` cases every run fails; in the others every run succeeds.
CaseRate all_alike(std::size_t cases, std::size_t failing, std::size_t starts) {
  CaseRate rate;
  for (std::size_t c = 0; c < cases; ++c)
    for (std::size_t s = 0; s < starts; ++s) rate.add("case " + std::to_string(c), c >= failing);
  return rate;
}

TEST(CaseRate, WithOneStartIsWilsonsInterval) {
  for (const std::size_t failing : {0u, 1u, 7u, 20u}) {
    const CaseRate rate = all_alike(20, failing, 1);
    EXPECT_EQ(rate.effective_runs(), 20);
    EXPECT_EQ(bounds(rate.interval()), bounds(wilson_interval(20 - failing, 20)));
    EXPECT_EQ(bounds(rate.interval(0.9)), bounds(wilson_interval(20 - failing, 20, 0.9)));
  }
}

TEST(CaseRate, CasesCountOnceWhereTheirStartsEndAlike) {
  for (const std::size_t failing : {0u, 10u, 20u}) {
    const CaseRate rate = all_alike(20, failing, 10);
    EXPECT_EQ(rate.runs(), 200u);
    EXPECT_EQ(rate.successes(), 10 * (20 - failing));
    EXPECT_EQ(rate.effective_runs(), 20);
    EXPECT_EQ(bounds(rate.interval()), bounds(wilson_interval(20 - failing, 20)));
  }
}

TEST(CaseRate, OfNoneOfAllAndOfCasesOfOneRate) {
  EXPECT_EQ(all_alike(5, 5, 4).interval().lower, 0);
  EXPECT_EQ(all_alike(5, 0, 4).interval().upper, 1);
  CaseRate rate;
  for (int c = 0; c < 50; ++c)
    for (int s = 0; s < 4; ++s) rate.add(std::to_string(c), s < 2);
  EXPECT_EQ(rate.effective_runs(), 200);
  EXPECT_EQ(bounds(rate.interval()), bounds(wilson_interval(100, 200)));
}

TEST(CaseRate, IsTheValueComputedByHand) {
  // Cases with 2/2, 1/2 and 0/2 successes; two cases of weight 0.25 with 2/2 and 0/2 more. The rate is 0.5, the squares
  // are 1 + 0 + 1 + 0.25 + 0.25 = 2.5, the weights 3.5, the runs 7. Variance 3.5 / 2.5 * 2.5 / 7^2 = 1 / 14; of
  // independent runs 0.25 / 7 = 1 / 28. The design effect is 2, and 6 runs are worth 3.
  CaseRate rate;
  for (const int successes : {2, 1, 0})
    for (int s = 0; s < 2; ++s) rate.add(std::to_string(successes), s < successes);
  EXPECT_NEAR(rate.effective_runs(), 3, 1e-12);
}

TEST(CaseRate, FewCasesMayAgreeByChance) {
  // 23 of 24 runs, 3 in each of 8 cases. With the two cases: rate (23 + 0.75) / 25.5 = 0.931373, squares 7 (3 - 3
  // rate)^2 + (2 - 3 rate)^2 + 0.25 ((3 - 3 rate)^2 + (3 rate)^2) = 2.889706; design effect 8.5 / 7.5 * 2.889706 /
  // 25.5^2 / (rate (1 - rate) / 25.5) = 2.009323.
  CaseRate rate;
  for (int run = 0; run < 24; ++run) rate.add(std::to_string(run / 3), run > 0);
  EXPECT_NEAR(rate.effective_runs(), 24 / 2.009323, 1e-5);
}

TEST(CaseRate, ExactIntervalsAreThoseOfTheBinomialDistribution) {
  // 3 of 3 are seen with the probability rate^3, 0.005 at the lower bound; 1 or more of 3 with 1 - (1 - rate)^3.
  const Interval all = all_alike(3, 0, 5).exact_interval(0.99);
  EXPECT_NEAR(all.lower, std::cbrt(0.005), 1e-12);
  EXPECT_EQ(all.upper, 1);
  EXPECT_EQ(all.confidence, 0.99);
  const Interval one = all_alike(3, 2, 1).exact_interval(0.99);
  EXPECT_NEAR(one.lower, 1 - std::cbrt(0.995), 1e-12);
  // 1 or fewer: (1 - rate)^3 + 3 rate (1 - rate)^2 = 0.005
  const double other = 1 - one.upper;
  EXPECT_NEAR(other * other * (other + 3 * one.upper), 0.005, 1e-12);
  EXPECT_EQ(all_alike(4, 4, 2).exact_interval(0.95).lower, 0);
}

TEST(CaseRate, OneCaseIsOneRunAndNoneIsNoRate) {
  CaseRate rate;
  for (int s = 0; s < 30; ++s) rate.add("only", true);
  EXPECT_EQ(rate.effective_runs(), 1);
  EXPECT_EQ(MESSAGE_OF(CaseRate().interval()), "a success rate of no runs has no interval; give at least one run");
  EXPECT_EQ(MESSAGE_OF(all_alike(2, 1, 2).interval(95)),
            "the confidence is 95.000000; give a fraction between 0 and 1, such as 0.95");
  EXPECT_EQ(MESSAGE_OF(CaseRate().exact_interval(0.95)),
            "a success rate of no runs has no interval; give at least one run");
}

/// How often the intervals hold the true rate. Each case draws a success or failure with the true rate. Each of its
/// runs takes this outcome with the probability sqrt(correlation), and else draws its own. So two runs of a case
/// correlate by `correlation`.
struct Coverage {
  double of_cases = 0, of_runs = 0;
};

Coverage coverage(std::size_t cases, std::size_t starts, double rate, double correlation) {
  constexpr int kTrials = 2000;
  marrow::Random random(7);
  int of_cases = 0, of_runs = 0;
  for (int trial = 0; trial < kTrials; ++trial) {
    CaseRate seen;
    for (std::size_t c = 0; c < cases; ++c) {
      const bool of_case = random.uniform() < rate;
      for (std::size_t s = 0; s < starts; ++s) {
        const bool takes_it = random.uniform() < std::sqrt(correlation);
        seen.add(std::to_string(c), takes_it ? of_case : random.uniform() < rate);
      }
    }
    const Interval cluster = seen.interval(), wilson = wilson_interval(seen.successes(), seen.runs());
    of_cases += cluster.lower <= rate && rate <= cluster.upper;
    of_runs += wilson.lower <= rate && rate <= wilson.upper;
  }
  return {double(of_cases) / kTrials, double(of_runs) / kTrials};
}

TEST(CaseRate, CoversTheRateThoughStartsOfACaseCorrelate) {
  for (const double rate : {0.5, 0.8, 0.9})
    for (const auto& [cases, starts] : {std::pair<std::size_t, std::size_t>{20, 5}, {50, 5}, {100, 10}}) {
      const Coverage covered = coverage(cases, starts, rate, 0.5);
      const bool are_few = rate * (1 - rate) * double(cases) < 3;  // rather too wide
      EXPECT_GE(covered.of_cases, 0.92) << rate << ", " << cases << " cases, " << starts << " starts";
      EXPECT_LE(covered.of_cases, are_few ? 0.98 : 0.97) << rate << ", " << cases << " cases, " << starts << " starts";
      EXPECT_LE(covered.of_runs, 0.8) << rate << ", " << cases << " cases, " << starts << " starts";
    }
}

TEST(CaseRate, CoversTheRateOfFewCasesToo) {
  // Without the two cases that are added to the variance, 8 cases with 10 starts would hold a rate of 0.95 in 40 %, and
  // 20 cases in 60 %, if the starts of a case correlate by 0.9 (the same simulation in numpy).
  for (const std::size_t cases : {8u, 20u})
    for (const double rate : {0.5, 0.8, 0.9, 0.95})
      for (const double correlation : {0.0, 0.5, 0.9})
        EXPECT_GE(coverage(cases, 10, rate, correlation).of_cases, 0.92) << cases << " " << rate << " " << correlation;
}

}  // namespace case_rate_test
