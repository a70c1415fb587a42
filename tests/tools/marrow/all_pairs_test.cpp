// SPDX-License-Identifier: Apache-2.0
// What a comparison of all pairs shows where nothing differs: in 500 simulated experiments, one or more findings in no
// more than the level says (as in null_experiments_test.cpp), over all pairs and figures together.
#include <gtest/gtest.h>

#include <cmath>
#include <compare/comparison.hpp>
#include <iostream>
#include <marrow/domain/random.hpp>

namespace all_pairs_test {

using namespace marrow;
using compare::CellRow;
using compare::Experiment;

/// Variants a, b, ... in the figures f0, f1, ...; lower is better.
Experiment experiment_of(std::size_t variants, std::size_t metrics) {
  Experiment experiment;
  experiment.name = "pairs";
  for (std::size_t v = 0; v < variants; ++v) experiment.variants.push_back({std::string(1, char('a' + v)), {}, {}});
  for (std::size_t m = 0; m < metrics; ++m) {
    compare::MetricChoice metric;
    metric.path = metric.label = "f" + std::to_string(m);
    experiment.metrics.push_back(metric);
  }
  experiment.compare_all = true;
  experiment.starts.push_back({"0", {}, {}});
  return experiment;
}

void add_row(std::vector<CellRow>& rows, const Experiment& experiment, std::size_t variant, const std::string& name,
             const std::vector<std::optional<double>>& values) {
  CellRow row;
  row.variant = experiment.variants[variant].name;
  row.case_name = name;
  row.start = "0";
  row.id = row.variant + "/" + name + "/0";
  row.values = values;
  row.units.resize(values.size());
  rows.push_back(row);
}

/// A cell is lost with the probability `fails`, whatever its variant.
std::vector<CellRow> null_rows(const Experiment& experiment, Random& random, std::size_t cases, double fails,
                               bool is_skewed) {
  std::vector<CellRow> rows;
  for (std::size_t c = 0; c < cases; ++c) {
    const double of_case = random.normal();
    for (std::size_t v = 0; v < experiment.variants.size(); ++v) {
      std::vector<std::optional<double>> values;
      for (std::size_t m = 0; m < experiment.metrics.size(); ++m) {
        const double noise = is_skewed ? -std::log(1 - random.uniform()) : random.normal();
        values.push_back(random.uniform() < fails ? std::nullopt : std::optional(of_case + noise));
      }
      add_row(rows, experiment, v, std::to_string(c), values);
    }
  }
  return rows;
}

struct Setting {
  std::size_t variants, metrics, cases;
  double fails;
  bool is_skewed;
};

TEST(AllPairs, ShowNothingInNineteenOfTwentyNullExperiments) {
  for (const Setting& one : {Setting{3, 1, 20, 0, false},
                             {6, 1, 20, 0, true},
                             {6, 2, 20, 0, false},
                             {4, 1, 40, 0.2, false},
                             {6, 1, 60, 0, false}}) {
    const Experiment experiment = experiment_of(one.variants, one.metrics);
    int wrong = 0;
    for (int i = 0; i < 500; ++i) {
      Random random(std::uint64_t(i) + 1);
      const cli::Answer answer =
          cli::answer_of(experiment, null_rows(experiment, random, one.cases, one.fails, one.is_skewed));
      ASSERT_EQ(answer.pairs.size(), one.variants * (one.variants - 1) / 2 * one.metrics);
      bool any = false;
      for (const cli::PairFinding& pair : answer.pairs)
        any = any || compare::difference_shown(pair.finding.comparison, pair.finding.p_holm);
      wrong += any;
    }
    std::cout << "all pairs of " << one.variants << " variants in " << one.metrics << " figures, " << one.cases
              << " cases, " << one.fails << " lost" << (one.is_skewed ? ", skewed: " : ": ") << wrong << " of 500 ("
              << 0.2 * wrong << " %)\n";
    EXPECT_LE(wrong, 43);
  }
}

/// a and b alike, c and d 1 worse, e loses all.
TEST(AllPairs, RankInGroups) {
  const Experiment experiment = experiment_of(5, 1);
  std::vector<CellRow> rows;
  for (std::size_t c = 0; c < 20; ++c) {
    const double of_case = 5 + 0.1 * double(c), sign = c % 2 ? 0.01 : -0.01;
    const std::string name = std::to_string(c);
    add_row(rows, experiment, 0, name, {of_case + 1});
    add_row(rows, experiment, 1, name, {of_case});
    add_row(rows, experiment, 2, name, {std::nullopt});
    add_row(rows, experiment, 3, name, {of_case + sign});
    add_row(rows, experiment, 4, name, {of_case + 1 + sign});
  }
  const cli::Answer answer = cli::answer_of(experiment, rows);
  std::string order;
  for (const cli::Ranking::Place& place : answer.rankings[0].places)
    order += experiment.variants[place.variant].name + std::to_string(place.rank) + place.group + " ";
  EXPECT_EQ(order, "b1a d1a a3b e3b c5c ");
  EXPECT_EQ(cli::ranking_sentence(experiment, answer, 0),
            "best in f0: b; 8 of 10 pairs differ; not told apart from it: d");
  EXPECT_TRUE(std::isinf(answer.rankings[0].places[4].median));
  EXPECT_EQ(answer.rankings[0].places[4].lost, 20u);
}

/// b has the lower median, but a is better in 17 of 20 cases by a little.
TEST(AllPairs, SayWhereCasesContradictTheOrder) {
  const Experiment experiment = experiment_of(2, 1);
  std::vector<CellRow> rows;
  for (std::size_t c = 0; c < 20; ++c) {
    const double a = double(c);
    const bool is_middle = c == 9 || c == 10;
    add_row(rows, experiment, 0, std::to_string(c), {a});
    add_row(rows, experiment, 1, std::to_string(c), {is_middle ? a - 0.01 : a + 0.3});
  }
  const cli::Answer answer = cli::answer_of(experiment, rows);
  EXPECT_EQ(cli::ranking_sentence(experiment, answer, 0),
            "best in f0: b; 1 of 1 pairs differ; shown to be better than it, compared case by case: a; not told apart "
            "from it: none");
}

}  // namespace all_pairs_test
