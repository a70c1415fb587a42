// SPDX-License-Identifier: Apache-2.0
// Experiments that extend others.
#include "experiment_files.hpp"

#include "marrow/compare/draw.hpp"
#include "marrow/runtime/pipeline/pipeline_names.hpp"

namespace experiment_sections_test {

using namespace experiment_files;
using marrow::compare::Experiment;

class ExperimentExtends : public ExperimentFiles {
 protected:
  Experiment extend(const std::string& base, const std::string& text) {
    scratch.write("base.yaml", base);
    return read("experiment: 1\nextends: base.yaml\n" + text);
  }
  void expect_fault_in(const std::string& file, int line, const std::string& message, const std::string& hint = "") {
    ASSERT_EQ(diagnostics.size(), 1u) << diagnostics.text();
    const marrow::Diagnostic fault = diagnostics.sorted()[0];
    EXPECT_EQ(std::filesystem::path(fault.place.file).filename(), file) << diagnostics.text();
    EXPECT_EQ(fault.place.line, line) << diagnostics.text();
    EXPECT_EQ(fault.message, message);
    EXPECT_EQ(fault.hint, hint);
  }
  static std::string names(const Experiment& experiment) {
    std::string text;
    for (const marrow::compare::Variant& one : experiment.variants) text += (text.empty() ? "" : " ") + one.name;
    return text;
  }
};

const std::string kBase = kStart + kVariants + kMetrics;

TEST_F(ExperimentExtends, NothingElseIsTheSameExperimentWithItsOwnName) {
  const Experiment base = read(kBase);
  const Experiment e = extend(kBase, "");
  ASSERT_TRUE(diagnostics.empty()) << diagnostics.text();
  EXPECT_EQ(e.name, "e");
  EXPECT_EQ(names(e), names(base));
  EXPECT_EQ(e.cases.size(), base.cases.size());
  EXPECT_EQ(e.metrics.size(), base.metrics.size());
  EXPECT_EQ(e.text, "experiment: 1\nextends: base.yaml\n");
  ASSERT_EQ(e.files.size(), 3u) << "the pipeline's, too";
  EXPECT_EQ(e.files[1].filename(), "base.yaml");
}

TEST_F(ExperimentExtends, MapsMergeAndListsAreReplaced) {
  const Experiment base = read_good(kBase);
  const std::string first = base.variants[0].name, metric = base.metrics[0].path;
  const Experiment e =
      extend("name: base\nhelp: of all\n" + kBase,
             "variants: {" + first + ": null, new: {c.value: 4}}\nmetrics: [{figure: " + metric + ", label: mine}]\n");
  ASSERT_TRUE(diagnostics.empty()) << diagnostics.text();
  EXPECT_EQ(e.name, "e");
  EXPECT_EQ(e.help, "of all");
  EXPECT_EQ(e.variants.size(), base.variants.size());
  EXPECT_EQ(e.variants.back().name, "new");
  ASSERT_EQ(e.metrics.size(), 1u);
  EXPECT_EQ(e.metrics[0].label, "mine");
}

TEST_F(ExperimentExtends, PathsStartWhereTheyAreWritten) {
  std::filesystem::create_directory(scratch.path / "below");
  std::filesystem::copy(scratch.path / "p.yaml", scratch.path / "below" / "p.yaml");
  scratch.write("below/base.yaml", "experiment: 1\npipeline: p.yaml\ncases: {seeds: 1..2}\n" + kVariants + kMetrics);
  const Experiment e = read("experiment: 1\nextends: below/base.yaml\n");
  EXPECT_EQ(e.pipeline, scratch.path / "below" / "p.yaml");
}

TEST_F(ExperimentExtends, FaultsAreShownInTheFileThatHasThem) {
  extend(kBase + "timed_cells: -1\n", "# one\n# two\n");
  expect_fault_in("base.yaml", 8, "'timed_cells' must be 0 to 1000, got -1");
  extend(kBase, "timed_cells: -1\n");
  expect_fault_in("e.yaml", 3, "'timed_cells' must be 0 to 1000, got -1");
  extend(kBase, "baseline: one\nbaseline: two\n");
  expect_fault_in("e.yaml", 4, "'baseline' is given twice in the experiment", "the first is at line 3");
  extend("experiment: 1\npipeline: [p.yaml\n", "");
  EXPECT_HAS(diagnostics.text(), "base.yaml:2:11: error: this [ is not closed");
  extend("- a\n", "");
  expect_fault_in("base.yaml", 1, "the experiment must be a map, got a list of 1", "write it as  key: value  lines");
}

TEST_F(ExperimentExtends, FaultsOfExtends) {
  scratch.write("base.yaml", kBase);
  read("experiment: 1\nextends: bse.yaml\n");
  expect_fault_in("e.yaml", 2, "there is no file 'bse.yaml' to extend", "did you mean 'base.yaml'?");
  read("experiment: 1\nextends: [base.yaml]\n");
  expect_fault_in("e.yaml", 2, "extends: expected a text, got a list of 1");
  extend("extends: e.yaml\n" + kBase, "");
  expect_fault_in("base.yaml", 1, "the files extend each other in a circle: e.yaml extends base.yaml extends e.yaml",
                  "one of them must stand alone");
}

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
  expect_fault(kStart + kVariants + kMetrics + "compare_all: pairs\n", 8,
               "compare_all: expected true or false, got 'pairs'");
}

// Faults of experiments that would mix things up or have no effect: options and inputs that two sections set, one
// folder under two names, and variants with the names of tuned points.

class ExperimentReplaced : public ExperimentFiles {
 protected:
  void expect_fault(const std::string& text, int line, const std::string& message,
                    const std::string& hint = "leave one of them out") {
    ExperimentFiles::expect_fault(text, line, message, hint);
  }
  void expect_none(const std::string& text) {
    read(text);
    EXPECT_TRUE(diagnostics.empty()) << text << diagnostics.text();
  }
};

std::string replaced(const std::string& what, const std::string& by, int line) {
  return what + " and by " + by + " in line " + std::to_string(line) + ", whose values would replace this one";
}

TEST_F(ExperimentReplaced, OptionsOfAVariant) {
  const std::string variants = kStart + "variants:\n  one: {}\n  two: {c.value: 2}\n" + kMetrics;  // lines 4 to 7
  const std::string what = "the option 'c.value' is set by variant 'two'";
  expect_fault(variants + "matrix: {c.value: [3, 4]}\n", 6, replaced(what, "'matrix'", 8));
  expect_fault(variants + "sweep: {options: {c.value: [3, 4]}, grid: 2}\n", 6, replaced(what, "'sweep'", 8));
  expect_none(variants + "matrix: {c.count: [3, 4]}\n");
  expect_none(variants + "set: {c.value: 5}\n");  // a variant is there to change what 'set' says
}

TEST_F(ExperimentReplaced, OptionsOfTheDisplacedNodeAndOfTheMatrix) {
  const std::string starts = "starts: {node: start, count: 2, rotation_deg: 3}\n";  // line 4
  const std::string end = kMetrics;
  expect_fault(kStart + starts + "variants: {far: {start.translation_mm: [9, 0, 0]}}\n" + end, 5,
               replaced("the option 'start.translation_mm' is set by variant 'far'", "'starts'", 4));
  expect_fault(kStart + starts + "set: {start.rotation_deg: [9, 0, 0]}\n" + kVariants + end, 5,
               replaced("the option 'start.rotation_deg' is set by 'set'", "'starts'", 4));
  expect_fault(kStart + starts + "matrix: {start.rotation_deg: [[1, 0, 0], [2, 0, 0]]}\n" + end, 5,
               replaced("the option 'start.rotation_deg' is set by 'matrix'", "'starts'", 4));
  read(kStart + starts + "set: {start.distance_mm: 4}\n" + kVariants + end);  // these starts have no distance
  EXPECT_EQ(diagnostics.text().find("'starts'"), std::string::npos) << diagnostics.text();
  expect_fault(kStart + "matrix: {c.value: [3, 4]}\nsweep: {options: {c.value: [3, 4]}, grid: 2}\n" + kMetrics, 4,
               replaced("the option 'c.value' is set by 'matrix'", "'sweep'", 5));
}

TEST_F(ExperimentReplaced, OptionsThatAreTuned) {
  const std::string variants = kStart + "variants:\n  one: {}\n  two: {c.value: 2}\n" + kMetrics;  // lines 4 to 7
  const std::string tune =
      "tune: {options: {c.value: [3, 4]}, optimizer: {uses: test.none}, points: 9, training_cases: 1, failed_as: 9";
  expect_fault(variants + tune + ", variant: two}\n", 6,
               replaced("the option 'c.value' is set by variant 'two'", "'tune'", 8));
  read(variants + tune + "}\n");  // the other variant, which is not tuned, may have a value of its own
  EXPECT_EQ(diagnostics.text().find("'c.value' is set by"), std::string::npos) << diagnostics.text();
  expect_fault(variants + "starts: {node: c, count: 2, distance_mm: 3}\ntune: {options: {c.distance_mm: [3, 4]}, " +
                   tune.substr(tune.find("optimizer")) + "}\n",
               9, replaced("the option 'c.distance_mm' is set by 'tune'", "'starts'", 8));
}

TEST_F(ExperimentReplaced, AVariantThatIsNamedAsATunedPoint) {
  const std::string tune =
      "tune: {options: {c.value: [3, 4]}, optimizer: {uses: test.none}, points: 9, training_cases: 1, failed_as: 9}\n";
  const auto fault = [](const std::string& name) {
    return "variant '" + name + "' is named as the points of 'tune' are, so its runs would count as theirs";
  };
  for (const char* name : {"tuned+3.5", "Tuned+4"})
    expect_fault(kStart + "variants:\n  one: {}\n  " + name + ": {c.count: 2}\n" + kMetrics + tune, 6, fault(name),
                 "rename it");
  expect_fault(kStart + "variants: {tuned: {}}\nmatrix: {c.count: [3]}\n" + kMetrics + tune, 4, fault("tuned+3"),
               "rename it");
  expect_none(kStart + "variants: {tuned+3.5: {}}\n" + kMetrics);
}

TEST_F(ExperimentReplaced, InputsThatAreDrawn) {
  const std::string simulate = kHead + "cases:\n  simulate:\n    pipeline: s.yaml\n    seeds: 1..2\n";
  const std::string end = kVariants + kMetrics;
  expect_fault(simulate + "    inputs: {x: 4}\n    draw: {x: [0, 1]}\n" + end, 7,
               replaced("the input 'x' is set by 'inputs'", "'draw'", 8));
  expect_fault(simulate + "    inputs: {shape: 4}\n    seed_input: [shape]\n" + end, 7,
               replaced("the input 'shape' is set by 'inputs'", "'seed_input'", 8));
  expect_fault(simulate + "    draw: {shape: [1, 2]}\n    seed_input: [shape]\n" + end, 7,
               replaced("the input 'shape' is set by 'draw'", "'seed_input'", 8));
  expect_fault(kStart + "inputs: {case: elsewhere}\n" + end, 4,
               replaced("the input 'case' is set by 'inputs'", "'cases'", 3));
  expect_fault(kHead + "cases: {seeds: 1..2, draw: {case: [0, 1]}}\ninputs: {case: 4}\n" + end, 4,
               replaced("the input 'case' is set by 'inputs'", "'draw'", 3));
}

TEST_F(ExperimentReplaced, OneFolderUnderTwoNames) {
  std::filesystem::create_directory_symlink("a", scratch.path / "cases" / "c");
  const std::string folder = (scratch.path / "cases").string();
  expect_fault(kStart + kVariants + kMetrics, 3,
               "the cases 'a' and 'c' are one folder, " + folder + "/a, to which " + folder + "/c leads",
               "leave one of them out, or its runs count twice");
  std::filesystem::remove(scratch.path / "cases" / "c");
  expect_none(kStart + kVariants + kMetrics);
}

// The section 'sweep' of an experiment.

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

TEST_F(ExperimentSweep, PointsFollowTheScaleAndTheSequence) {
  EXPECT_EQ(names(kGood + "sweep: {options: {c.value: {range: [1, 100], scale: log}}, grid: 3}\n"),
            (Names{"1", "10", "100"}));
  EXPECT_EQ(names(kGood + "sweep: {options: {c.count: {range: [1, 3], whole: true}}, grid: 9}\n"),
            (Names{"1", "2", "3"}));
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

TEST_F(ExperimentSweep, Faults) {
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

}  // namespace experiment_sections_test
