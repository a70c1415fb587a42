// SPDX-License-Identifier: Apache-2.0
// The section 'sweep' of an experiment.
#include "experiment_files.hpp"
#include "marrow/compare/sobol.hpp"
#include "marrow/runtime/pipeline/pipeline_names.hpp"

#include <set>

namespace experiment_sweep_test {

using namespace experiment_files;
using marrow::compare::Experiment;
using marrow::compare::sobol_point;
using marrow::compare::Variant;

const std::string kGood = kStart + kMetrics;  // lines 1 to 4

class ExperimentSweep : public ExperimentFiles {
 protected:
  void expect_sweep_fault(const std::string& sweep, const std::string& message, const std::string& hint = "") {
    expect_fault(kGood + "sweep: {" + sweep + "}\n", 5, message, hint);
  }
  std::vector<std::string> names(const std::string& text) {
    experiment = read_good(text);
    return marrow::names_of(experiment.variants);
  }
  Experiment experiment;
};

using Names = std::vector<std::string>;

TEST_F(ExperimentSweep, AGridIsEveryCombination) {
  EXPECT_EQ(names(kGood + "sweep:\n  options: {c.value: [10, 20], c.count: {range: [1, 3], whole: true}}\n  grid: 3\n"),
            (Names{"10+1", "10+2", "10+3", "15+1", "15+2", "15+3", "20+1", "20+2", "20+3"}));
  const Variant& one = experiment.variants[5];
  ASSERT_EQ(one.overrides.size(), 2u);
  EXPECT_EQ(one.overrides[0].key, "c.value");
  EXPECT_EQ(one.overrides[0].value, "15");
  EXPECT_EQ(one.overrides[1].value, "3");
  EXPECT_EQ(one.swept, (std::vector<double>{15, 3}));
  EXPECT_EQ(one.swept_from, "");
  EXPECT_EQ(experiment.swept[1].key, "c.count");
  EXPECT_TRUE(experiment.sweep_is_grid);
}

TEST_F(ExperimentSweep, EachVariantIsSwept) {
  EXPECT_EQ(names(kGood + kVariants + "matrix: {c.word: [one]}\nsweep: {options: {c.count: [1, 2]}, grid: 2}\n"),
            (Names{"one+one+1", "one+one+2", "two+one+1", "two+one+2"}));
  EXPECT_EQ(experiment.variants[3].swept_from, "two+one");
}

TEST_F(ExperimentSweep, ALogScaleKeepsRatios) {
  EXPECT_EQ(names(kGood + "sweep: {options: {c.value: {range: [1, 100], scale: log}}, grid: 3}\n"),
            (Names{"1", "10", "100"}));
}

TEST_F(ExperimentSweep, WholeNumbersAreNotTriedTwice) {
  EXPECT_EQ(names(kGood + "sweep: {options: {c.count: {range: [1, 3], whole: true}}, grid: 9}\n"),
            (Names{"1", "2", "3"}));
}

TEST_F(ExperimentSweep, SobolsPointsFillTheRanges) {
  EXPECT_EQ(names(kGood + "sweep: {options: {c.value: [0, 100], c.path: [0, 1]}, sobol: 2}\n"),
            (Names{"0+0", "50+0.5"}));
  EXPECT_EQ(names(kGood + "sweep: {options: {c.value: [0, 100]}, sobol: 4}\n"), (Names{"0", "50", "75", "25"}));
  EXPECT_FALSE(experiment.sweep_is_grid);
}

TEST(Sobol, IsTheSequenceOfJoeAndKuo) {
  // As scipy's qmc.Sobol(6, scramble=False) has them.
  const std::array<double, 6> second{0.75, 0.25, 0.25, 0.25, 0.75, 0.75};
  EXPECT_EQ(sobol_point(0), (std::array<double, 6>{}));
  EXPECT_EQ(sobol_point(1), (std::array<double, 6>{0.5, 0.5, 0.5, 0.5, 0.5, 0.5}));
  EXPECT_EQ(sobol_point(2), second);
  // The first 64 points have one in each 64th of every dimension.
  for (std::size_t d = 0; d < 6; ++d) {
    std::set<int> cells;
    for (std::size_t i = 0; i < 64; ++i) cells.insert(int(64 * sobol_point(i)[d]));
    EXPECT_EQ(cells.size(), 64u) << d;
  }
}

TEST_F(ExperimentSweep, FaultsOfKeys) {
  const std::string option = "options: {c.value: [1, 2]}";
  expect_fault(kGood + "sweep: 5\n", 5, "'sweep' must be a map, got '5'", "write it as  key: value  lines");
  expect_sweep_fault(option + ", grids: 3, grid: 3", "unknown key 'grids' in 'sweep'", "did you mean 'grid'?");
  expect_sweep_fault("grid: 3", "'sweep' names no option",
                     "write it as  sweep: {options: {edges.high: [60, 90]}, grid: 5}");
  for (const char* both : {"", ", grid: 3, sobol: 4"})
    expect_sweep_fault(option + both,
                       "'sweep' must say either how fine its grid is or how many of Sobol's points it takes",
                       "add  grid: 5  for 5 values of each option, or  sobol: 32");
  expect_sweep_fault(option + ", grid: 1", "'grid' must be 2 to 1000, got 1");
  expect_sweep_fault("options: {c.value: {range: [1, 2], scale: logg}}, grid: 3", "'logg' is no scale",
                     "did you mean 'log'?");
  expect_sweep_fault("options: {c.value: {scale: linear}}, grid: 3", "'c.value' has no range", "add  range: [60, 90]");
}

TEST_F(ExperimentSweep, FaultsOfRanges) {
  for (const char* wrong : {"5", "[1]", "[1, 2, 3]"})
    expect_sweep_fault("options: {c.value: " + std::string(wrong) + "}, grid: 3",
                       "'c.value' must have a range of two ends", "write it as  c.value: [60, 90]");
  expect_sweep_fault("options: {c.value: [2, 2]}, grid: 3",
                     "the range of 'c.value' must end above its beginning, got 2 to 2");
  expect_sweep_fault("options: {c.value: [1, far]}, grid: 3", "c.value: expected a number, got 'far'");
  expect_sweep_fault("options: {c.value: {range: [0, 2], scale: log}}, grid: 3",
                     "a range with a log scale must begin above 0, got 0");
  expect_sweep_fault("options: {c.value: [1, 2000]}, grid: 2",
                     "option 'value' of test.constant: 2000 is above the most allowed, 1000");
}

TEST_F(ExperimentSweep, FaultsOfNumbersOfVariants) {
  expect_sweep_fault("options: {c.value: [1, 2], c.count: [1, 2]}, grid: 40",
                     "a grid of 40 values of 2 options makes more than the 1000 variants that can be compared",
                     "take fewer values, or Sobol's points, as  sobol: 64");
  expect_fault(kGood + "matrix: {c.word: [one, two]}\nsweep: {options: {c.value: [1, 2]}, grid: 600}\n", 6,
               "2 variants at 600 points are 1200, at most 1000 can be compared", "take fewer points");
  expect_sweep_fault(
      "options: {a.a: [1, 2], b.a: [1, 2], c.a: [1, 2], d.a: [1, 2], e.a: [1, 2], f.a: [1, 2], g.a: [1, "
      "2]}, sobol: 4",
      "'sweep' has 7 options, at most 6 are possible");
  expect_sweep_fault("options: {c.value: [1, 1.000001]}, grid: 3", "two points of the sweep are written alike, as '1'",
                     "take a wider range, or fewer points");
}

}  // namespace experiment_sweep_test
