// SPDX-License-Identifier: Apache-2.0
// Tests and intervals keep their level. Each is tried in 500 simulated experiments without a difference, or with a
// known true value: tests find something, and intervals miss the value, no more often than the level says. 44 or more
// of 500 contradict a level of 5 %: a binomial count of that level reaches 44 with a probability of 0.025 %
// (scipy.stats.binom.sf(43, 500, 0.05)). There are about 200 counts here.
#include <gtest/gtest.h>

#include <algorithm>
#include <functional>
#include <iostream>
#include <marrow/compare/bootstrap.hpp>
#include <marrow/compare/case_rate.hpp>
#include <marrow/compare/stop_rule.hpp>
#include <marrow/domain/random.hpp>
#include <random>

namespace null_experiments_test {

using namespace marrow::compare;
using marrow::Random;

constexpr int kExperiments = 500;
constexpr int kMost = 43;

using Draw = std::function<double(Random&)>;

double symmetric(Random& random) { return (random.uniform() < 0.1 ? 10 : 1) * random.normal(); }
/// Exponential, with a median of 0 and a mean of 1 - ln 2.
double skewed(Random& random) { return -std::log(1 - random.uniform()) - std::log(2.0); }
/// On a grid of 0.1: many are 0, and many are equal.
double tied(Random& random) { return 0.1 * std::round(2 * random.normal()); }

/// Counts the experiments that go wrong, prints the rate, and compares it with 5 %.
void expect_within_level(const std::string& what, const std::function<bool(Random&)>& goes_wrong) {
  int wrong = 0;
  for (int i = 0; i < kExperiments; ++i) {
    Random random(std::uint64_t(i) + 1);
    wrong += goes_wrong(random);
  }
  std::cout << what << ": " << wrong << " of " << kExperiments << " (" << 100.0 * wrong / kExperiments << " %)\n";
  EXPECT_LE(wrong, kMost) << what;
}

/// Pairs whose difference is drawn. Each of the two fails with the given probability.
std::vector<Pair> null_pairs(Random& random, std::size_t cases, const Draw& draw, double fails = 0) {
  std::vector<Pair> pairs;
  for (std::size_t c = 0; c < cases; ++c) {
    const double reference = 0.1 * std::round(100 * random.uniform());
    Pair pair{std::to_string(c), reference, reference + draw(random)};
    if (random.uniform() < fails) pair.reference.reset();
    if (random.uniform() < fails) pair.variant.reset();
    pairs.push_back(pair);
  }
  return pairs;
}

TEST(NullExperiments, SignedRanks) {
  for (const std::size_t cases : {6u, 8u, 13u, 20u, 40u, 80u}) {
    const auto expect = [&](const std::string& what, const Draw& draw, double fails) {
      expect_within_level("p < 0.05, " + std::to_string(cases) + " cases, " + what, [&](Random& random) {
        return compare_pairs(null_pairs(random, cases, draw, fails), false).test.p < 0.05;
      });
    };
    expect("symmetric", symmetric, 0);
    expect("with ties and zeros", tied, 0);
    expect("with failures of both", symmetric, 0.3);
  }
}

TEST(NullExperiments, DifferencesThatAreShown) {
  for (const std::size_t cases : {6u, 20u, 80u})
    for (const auto& [what, draw] :
         {std::pair<std::string, Draw>{"symmetric", symmetric}, {"skewed, median 0", skewed}})
      expect_within_level("difference shown, " + std::to_string(cases) + " cases, " + what, [&](Random& random) {
        const Comparison comparison = compare_pairs(null_pairs(random, cases, draw), false);
        return difference_shown(comparison, comparison.test.p);
      });
}

StopRule rule_of(StopRule::Goal goal, std::size_t first, std::size_t every, std::size_t most) {
  StopRule rule;
  rule.goal = goal;
  rule.first_cases = first;
  rule.look_every = every;
  rule.most_cases = most;
  return rule;
}

TEST(NullExperiments, StopRuleOfADifference) {
  for (const auto& [first, every, most] :
       {std::tuple<std::size_t, std::size_t, std::size_t>{20, 20, 200}, {6, 6, 60}, {3, 1, 40}})
    for (const auto& [what, draw] :
         {std::pair<std::string, Draw>{"symmetric", symmetric}, {"skewed, median 0", skewed}}) {
      const StopPlan plan(rule_of(StopRule::Goal::difference, first, every, most));
      expect_within_level("stop: difference, from " + std::to_string(first) + " cases, " + what, [&](Random& random) {
        const std::vector<Pair> all = null_pairs(random, most, draw);
        for (const std::size_t cases : plan.looks()) {
          const std::vector<Pair> pairs(all.begin(), all.begin() + std::ptrdiff_t(cases));
          if (look_at_difference(plan, cases, pairs, false).is_met) return true;
        }
        return false;
      });
    }
}

/// Looks until the rule says stop. Returns whether the interval then misses the true value.
bool misses_at_the_end(const StopPlan& plan, double truth,
                       const std::function<std::optional<Interval>(std::size_t cases, double confidence)>& interval) {
  for (const std::size_t cases : plan.looks()) {
    const Look look = look_at_widths(plan, cases, {interval(cases, 1 - plan.level_at(cases))});
    if (look.is_met || look.is_last()) return look.interval.lower > truth || look.interval.upper < truth;
  }
  return false;
}

TEST(NullExperiments, StopRuleOfTheWidthOfAMedian) {
  for (const std::size_t first : {2u, 3u, 6u})
    for (const auto& [what, draw] : {std::pair<std::string, Draw>{"symmetric", symmetric}, {"skewed", skewed}})
      for (const double width : {1.0, 3.0}) {
        StopRule rule = rule_of(StopRule::Goal::width, first, first, 20 * first);
        rule.width = width;
        const StopPlan plan(rule);
        expect_within_level("stop: width of a median, from " + std::to_string(first) + " cases, " + what,
                            [&](Random& random) {
                              ValuesOfCases values;
                              return misses_at_the_end(plan, 0, [&](std::size_t cases, double confidence) {
                                while (values.size() < cases) values.push_back({draw(random)});
                                return median_interval_of(values, confidence);
                              });
                            });
      }
}

/// The runs of a case: each takes the outcome of its case with the probability sqrt(correlation), else its own.
void add_case(CaseRate& rate, Random& random, const std::string& name, std::size_t runs, double truth,
              double correlation) {
  const bool of_case = random.uniform() < truth;
  for (std::size_t run = 0; run < runs; ++run) {
    const bool takes_it = random.uniform() < std::sqrt(correlation);
    rate.add(name, takes_it ? of_case : random.uniform() < truth);
  }
}

TEST(NullExperiments, StopRuleOfTheWidthOfARate) {
  for (const std::size_t first : {2u, 3u, 6u})
    for (const double truth : {0.5, 0.8, 0.9, 0.95, 0.99})
      for (const std::size_t runs : {1u, 5u})
        for (const double width : {0.3, 0.6}) {
          StopRule rule = rule_of(StopRule::Goal::width, first, first, 20 * first);
          rule.width = width;
          const StopPlan plan(rule);
          expect_within_level("stop: width of a rate of " + std::to_string(truth).substr(0, 4) + ", from " +
                                  std::to_string(first) + " cases with " + std::to_string(runs) + " runs",
                              [&](Random& random) {
                                CaseRate rate;
                                std::size_t added = 0;
                                return misses_at_the_end(plan, truth, [&](std::size_t cases, double confidence) {
                                  for (; added < cases; ++added)
                                    add_case(rate, random, std::to_string(added), runs, truth, 0.5);
                                  return rate.exact_interval(confidence);
                                });
                              });
        }
}

TEST(NullExperiments, IntervalsOfOneValueACase) {
  for (std::size_t cases = 2; cases <= 20; ++cases)
    for (const auto& [what, draw] : {std::pair<std::string, Draw>{"symmetric", symmetric}, {"skewed", skewed}}) {
      expect_within_level("interval of a median, " + std::to_string(cases) + " cases, " + what, [&](Random& random) {
        ValuesOfCases values;
        while (values.size() < cases) values.push_back({draw(random)});
        const std::optional<Interval> interval = median_interval_of(values);
        return interval && (interval->lower > 0 || interval->upper < 0);
      });
      expect_within_level("interval of a difference, " + std::to_string(cases) + " cases, " + what,
                          [&](Random& random) {
                            const Interval interval = compare_pairs(null_pairs(random, cases, draw), false).interval;
                            return interval.lower > 0 || interval.upper < 0;
                          });
    }
}

/// median_interval_of(), with fewer resamples.
std::optional<Interval> interval_of_runs(const ValuesOfCases& values) {
  if (values.size() < 6) return median_interval_of(values);
  return median_of_runs_interval(values, {1, 0.95, 1000, 1});
}

TEST(NullExperiments, IntervalsOfSeveralRunsACase) {
  // The median of an exponential variable times a plus another times b, with a^2 and b^2 the shares of the variance.
  // For a = b it is a times that of the gamma distribution (scipy.stats.gamma.ppf(0.5, 2)). Else it is where the
  // distribution 1 - (a exp(-x / a) - b exp(-x / b)) / (a - b) is 0.5 (scipy.optimize.brentq).
  struct Truth {
    double correlation, of_exponentials;
  };
  for (const Truth& truth : {Truth{0, std::log(2.0)}, Truth{0.5, 1.186771}, Truth{0.9, 1.003305}})
    for (const std::size_t cases : {2u, 5u, 6u, 7u, 9u, 12u, 20u})
      for (const bool is_skewed : {false, true}) {
        expect_within_level(
            std::string("interval of a median, ") + (is_skewed ? "skewed, " : "normal, ") + std::to_string(cases) +
                " cases with 4 runs, correlation " + std::to_string(truth.correlation).substr(0, 3),
            [&](Random& random) {
              const auto drawn = [&] { return is_skewed ? -std::log(1 - random.uniform()) : random.normal(); };
              ValuesOfCases values(cases);
              for (std::vector<double>& own : values) {
                const double of_case = std::sqrt(truth.correlation) * drawn();
                while (own.size() < 4) own.push_back(of_case + std::sqrt(1 - truth.correlation) * drawn());
              }
              const std::optional<Interval> interval = interval_of_runs(values);
              const double median = is_skewed ? truth.of_exponentials : 0;
              return interval && (interval->lower > median || interval->upper < median);
            });
      }
}

// Simulated comparisons of two variants. A planted difference is found; without one, none is shown.

constexpr int case_count = 20;
constexpr int starts = 3;
constexpr int null_experiments = 500;

/// Errors of `case_count` cases in mm, a few starts each. The difference of the variants scatters from case to case
/// with sd 0.1 mm, and ten times that in every tenth case; starts of one case share most of it.
std::vector<Pair> experiment(std::mt19937_64& random, double shift_mm) {
  std::normal_distribution<double> normal;
  std::uniform_real_distribution<double> uniform;
  std::vector<Pair> pairs;
  for (int k = 0; k < case_count; ++k) {
    const double reference_mm = 0.5 + 0.2 * std::abs(normal(random));
    const double of_case_mm = (uniform(random) < 0.1 ? 1.0 : 0.1) * normal(random);
    for (int start = 0; start < starts; ++start)
      pairs.push_back(
          {"case " + std::to_string(k), reference_mm, reference_mm + shift_mm + of_case_mm + 0.03 * normal(random)});
  }
  return pairs;
}

/// A count of false findings contradicts `level` if even a 99.9 % interval of its rate lies above it.
void expect_within(int found, int experiments, double level) {
  const Interval interval =
      wilson_interval(static_cast<std::size_t>(found), static_cast<std::size_t>(experiments), 0.999);
  EXPECT_LE(interval.lower, level) << found << " of " << experiments;
}

TEST(PlantedDifference, IsNotShownWhereThereIsNone) {
  std::mt19937_64 random(1);
  int small_p = 0, shown = 0, covered = 0, starts_as_cases = 0;
  for (int i = 0; i < null_experiments; ++i) {
    const std::vector<Pair> pairs = experiment(random, 0);
    const Comparison comparison = compare_pairs(pairs, false);
    small_p += comparison.test.p < 0.05;
    shown += difference_shown(comparison, comparison.test.p);
    covered += comparison.interval.lower <= 0 && comparison.interval.upper >= 0;
    std::vector<double> differences;
    for (const Pair& pair : pairs) differences.push_back(*pair.variant - *pair.reference);
    starts_as_cases += signed_rank_test(differences).p < 0.05;
  }
  std::cout << "of " << null_experiments << " without a difference: p < 0.05 in " << small_p << ", shown in " << shown
            << ", 0 within the 95 % interval in " << covered << "; with starts taken for cases p < 0.05 in "
            << starts_as_cases << "\n";
  expect_within(small_p, null_experiments, 0.05);
  expect_within(shown, null_experiments, 0.05);
  expect_within(null_experiments - covered, null_experiments, 0.05);
  // This is why a case counts by its mean: the starts of a case are not independent evidence.
  EXPECT_GT(starts_as_cases, 3 * small_p);
}

TEST(PlantedDifference, IsNotShownAmongSeveralVariantsAfterHolm) {
  std::mt19937_64 random(2);
  int uncorrected = 0, corrected = 0;
  for (int i = 0; i < null_experiments; ++i) {
    std::vector<double> p_values;
    for (int variant = 0; variant < 5; ++variant)
      p_values.push_back(compare_pairs(experiment(random, 0), false).test.p);
    uncorrected += *std::min_element(p_values.begin(), p_values.end()) < 0.05;
    const std::vector<double> holm_p = holm(p_values);
    corrected += *std::min_element(holm_p.begin(), holm_p.end()) < 0.05;
  }
  std::cout << "five variants without a difference: one or more p < 0.05 in " << uncorrected << " of "
            << null_experiments << ", after Holm in " << corrected << "\n";
  expect_within(corrected, null_experiments, 0.05);
  EXPECT_GT(uncorrected, 2 * corrected);
}

/// The number of experiments, of 100, that show the difference of one of three variants after Holm.
int found_of_100(double shift_mm) {
  std::mt19937_64 random(3);
  int found = 0, covered = 0;
  for (int i = 0; i < 100; ++i) {
    const Comparison comparison = compare_pairs(experiment(random, shift_mm), false);
    const double p = holm({comparison.test.p, 0.5, 0.9})[0];
    found += difference_shown(comparison, p) && comparison.median_difference > 0;
    covered += comparison.interval.lower <= shift_mm && comparison.interval.upper >= shift_mm;
  }
  std::cout << shift_mm << " mm planted, as one of three variants: found in " << found
            << " of 100, within the 95 % interval in " << covered << "\n";
  EXPECT_GE(covered, 90);
  return found;
}

TEST(PlantedDifference, IsFound) {
  EXPECT_GE(found_of_100(0.1), 60);  // one sd of the bulk of the cases
  EXPECT_GE(found_of_100(0.2), 95);
}

}  // namespace null_experiments_test
