// SPDX-License-Identifier: Apache-2.0
// The factors of a matrix and the levels of its variants; comparisons of all pairs.
#include "experiment_files.hpp"
#include "marrow/compare/experiment_notes.hpp"

namespace experiment_factors_test {

using namespace experiment_files;
using marrow::compare::Experiment;

std::string levels_text(const Experiment& experiment) {
  std::string text;
  for (const marrow::compare::Variant& variant : experiment.variants) {
    text += variant.name + ":";
    for (const std::size_t level : variant.levels) text += " " + std::to_string(level);
    text += "\n";
  }
  return text;
}

TEST_F(ExperimentFiles, FactorsOfAMatrix) {
  const Experiment e = read_good(kStart + kMetrics + "matrix:\n  c.value: [1, 2]\n  c.count: [3, 4, 5]\n");
  ASSERT_EQ(e.factors.size(), 2u);
  EXPECT_EQ(e.factors[0].name, "c.value");
  EXPECT_EQ(e.factors[1].levels, (std::vector<std::string>{"3", "4", "5"}));
  EXPECT_EQ(levels_text(e), "1+3: 0 0\n1+4: 0 1\n1+5: 0 2\n2+3: 1 0\n2+4: 1 1\n2+5: 1 2\n");
  EXPECT_FALSE(e.compare_all);
}

TEST_F(ExperimentFiles, NamedVariantsAreAFactorOfTheMatrix) {
  const Experiment e = read_good(kStart + kVariants + kMetrics + "matrix: {c.count: [3, 4]}\n");
  EXPECT_EQ(e.factors[0].name, "variants");
  EXPECT_EQ(e.factors[0].levels, (std::vector<std::string>{"one", "two"}));
  EXPECT_EQ(levels_text(e), "one+3: 0 0\none+4: 0 1\ntwo+3: 1 0\ntwo+4: 1 1\n");
  EXPECT_TRUE(read(kStart + kVariants + kMetrics).factors.empty());
}

TEST_F(ExperimentFiles, PointsOfASweepKeepTheLevels) {
  const Experiment e =
      read_good(kStart + kMetrics + "matrix: {c.count: [3, 4]}\nsweep: {options: {c.value: [1, 2]}, grid: 2}\n");
  EXPECT_EQ(levels_text(e), "3+1: 0\n3+2: 0\n4+1: 1\n4+2: 1\n");
}

TEST_F(ExperimentFiles, AllPairsAreCounted) {
  const Experiment e = read_good(kStart + kMetrics + "compare_all: true\nmatrix: {c.count: [3, 4, 5, 6]}\n");
  EXPECT_TRUE(e.compare_all);
  EXPECT_EQ(marrow::compare::comparison_counts(e).comparisons, 6u);
  EXPECT_EQ(marrow::compare::comparison_counts(e).fewest_cases, 8u);  // 6 * 2 / 2^8 = 0.047
}

TEST_F(ExperimentFiles, AllPairsCanBeTooMany) {
  std::string list;
  for (int i = 0; i < 200; ++i) list += std::to_string(i) + ", ";
  const std::string all = kStart + kMetrics + "compare_all: true\nmatrix: {c.count: [" + list;
  EXPECT_EQ(read(all + "]}\n").variants.size(), 200u);
  EXPECT_TRUE(diagnostics.empty()) << diagnostics.text();  // 19900 comparisons
  expect_fault(all + "200]}\n", 5,
               "all pairs of 201 variants in 1 figure are 20100 comparisons, at most 20000 can be made",
               "leave variants or figures out, or compare each with the baseline alone");
}

TEST_F(ExperimentFiles, CompareAllIsTrueOrFalse) {
  expect_fault(kStart + kVariants + kMetrics + "compare_all: pairs\n", 8,
               "compare_all: expected true or false, got 'pairs'");
}

}  // namespace experiment_factors_test
