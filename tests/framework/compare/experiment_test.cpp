// SPDX-License-Identifier: Apache-2.0
// What is read from experiment files.

#include "experiment_files.hpp"
#include "marrow/compare/cell.hpp"

namespace experiment_test {

using namespace experiment_files;
using marrow::compare::Experiment;

TEST_F(ExperimentFiles, FoldersVariantsAndSuccess) {
  const Experiment e = read_good(kStart + kVariants + kMetrics + "success: {number.value: 3}\nbaseline: two\n");
  ASSERT_EQ(e.cases.size(), 2u);
  EXPECT_EQ(e.cases[0].name, "a");
  EXPECT_FALSE(e.cases[0].is_simulated);
  EXPECT_EQ(e.cases[0].seed, 1u);
  EXPECT_EQ(e.baseline, 1u);
  EXPECT_EQ(e.metrics[0].limit, 3.0);
  EXPECT_EQ(e.cell_count(), 4u);
  EXPECT_EQ(marrow::compare::cell_id(e, {1, 0, 0}), "two/a/0");
  EXPECT_EQ(marrow::compare::cell_of(e, "two/a/0")->variant, 1u);
  EXPECT_FALSE(marrow::compare::cell_of(e, "three/a/0"));
  const auto arguments = marrow::compare::arguments_of(e, {1, 0, 0}, e.cases[0].folder);
  ASSERT_EQ(arguments.overrides.size(), 1u);
  EXPECT_EQ(arguments.overrides[0].key + "=" + arguments.overrides[0].value, "c.value=2");
}

TEST_F(ExperimentFiles, APathThroughALinkIsWhatTheSystemFinds) {
  namespace fs = std::filesystem;
  fs::create_directories(scratch.path / "other" / "inner");
  fs::create_directories(scratch.path / "other" / "cases" / "c");
  fs::create_directory_symlink("other/inner", scratch.path / "link");
  fs::copy_file(scratch.path / "p.yaml", scratch.path / "other" / "p.yaml");
  const Experiment e = read_good("experiment: 1\npipeline: link/../p.yaml\ncases: {folders: [link/../cases/*]}\n" +
                                 kVariants + kMetrics);
  EXPECT_TRUE(fs::equivalent(e.pipeline, scratch.path / "other" / "p.yaml"));
  ASSERT_EQ(e.cases.size(), 1u);
  EXPECT_EQ(e.cases[0].name, "c");
  EXPECT_EQ(read(kHead + "cases: {folders: [cases/*/../*]}\n" + kVariants + kMetrics).cases.size(), 2u) << "each once";
}

TEST_F(ExperimentFiles, MetricsHaveNamesForPeople) {
  const Experiment e =
      read_good(kStart + kVariants +
                "metrics:\n  - {figure: number.value, label: Sum}\n  - other.value\nsuccess: {number.value: 3}\n");
  ASSERT_EQ(e.metrics.size(), 2u);
  EXPECT_EQ(e.metrics[0].path + " " + e.metrics[0].label, "number.value Sum");
  EXPECT_EQ(e.metrics[0].limit, 3.0);
  EXPECT_EQ(e.metrics[1].label, "other.value");
}

TEST_F(ExperimentFiles, WhatIsSetForAllComesBeforeWhatAVariantChanges) {
  const std::string set = "set: {f.value: 3, c.word: two, c.uses: test.constant}\n";
  const Experiment e = read_good(kStart + set + kVariants + kMetrics);
  const auto text = [&](std::size_t variant) {
    std::string all;
    for (const auto& one : marrow::compare::arguments_of(e, {variant, 0, 0}, e.cases[0].folder).overrides)
      all += one.key + "=" + one.value + " ";
    return all;
  };
  EXPECT_EQ(text(0), "c.uses=test.constant f.value=3 c.word=two ");
  EXPECT_EQ(text(1), "c.uses=test.constant f.value=3 c.word=two c.value=2 ");
  EXPECT_EQ(e.variants[0].overrides.size(), 0u) << "changes of all variants belong to no single one";
}

TEST_F(ExperimentFiles, MatrixGivesEveryCombination) {
  const Experiment e = read_good(kStart + "matrix:\n  c.value: [1, 2, 3]\n  n.uses: [test.add, test.add]\n" + kMetrics);
  ASSERT_EQ(e.variants.size(), 6u);
  std::set<std::string> names;
  for (const auto& variant : e.variants) names.insert(variant.name);
  EXPECT_EQ(names.size(), 6u) << "all names differ";
  EXPECT_TRUE(names.contains("2+add"));
}

TEST_F(ExperimentFiles, StartsMayBeDrawnByTheirDistance) {
  add_displaced_node();
  const Experiment e =
      read_good(kStart + kVariants + kMetrics + "starts: {node: s, count: 1000, rotation_deg: 3, distance_mm: 40}\n");
  double mean = 0;
  int below_10 = 0;
  for (const auto& start : e.starts) {
    EXPECT_TRUE(start.distance_mm >= 0 && start.distance_mm < 40);
    mean += start.distance_mm / 1000;
    below_10 += start.distance_mm < 10;
  }
  EXPECT_NEAR(mean, 20, 1.2);
  EXPECT_NEAR(below_10, 250, 45) << "four deviations of a uniform draw";
}

TEST_F(ExperimentFiles, AShortestDistanceIsGivenToTheNodeToo) {
  add_displaced_node();
  const auto options = [&](const std::string& distance) {
    const Experiment e =
        read_good(kStart + kVariants + kMetrics + "starts: {node: s, count: 1, rotation_deg: 3" + distance + "}\n");
    std::string keys;
    for (const auto& one : marrow::compare::arguments_of(e, {0, 0, 0}, e.cases[0].folder).overrides)
      if (one.key.starts_with("s.")) keys += one.key + " ";
    return keys;
  };
  EXPECT_EQ(options(", distance_mm: 0.5"), "s.rotation_deg s.translation_mm s.distance_mm ");
  EXPECT_EQ(options(""), "s.rotation_deg s.translation_mm ");
}

TEST_F(ExperimentFiles, StartsAreDrawnByTheirProtocol) {
  add_displaced_node();
  const std::string text =
      kStart + kVariants + kMetrics + "starts: {node: s, count: 2000, seed: 7, rotation_deg: 3, translation_mm: 5}\n";
  const Experiment e = read_good(text);
  ASSERT_EQ(e.starts.size(), 2000u);
  double longest = 0, mean = 0, x = 0, angle = 0;
  for (const auto& start : e.starts) {
    const double length = std::hypot(start.translation_mm[0], start.translation_mm[1], start.translation_mm[2]);
    longest = std::max(longest, length);
    mean += length / 2000;
    x += start.translation_mm[0] / length / 2000;
    angle = std::max(angle, std::hypot(start.rotation_deg[0], start.rotation_deg[1], start.rotation_deg[2]));
  }
  EXPECT_LE(longest, 5);
  EXPECT_GT(longest, 4.9);
  EXPECT_NEAR(mean, 2.5, 0.1) << "the length is uniform";
  EXPECT_NEAR(x, 0, 0.04) << "no direction is preferred";
  EXPECT_LE(angle, 3);
  EXPECT_EQ(read(text).starts[5].rotation_deg, e.starts[5].rotation_deg) << "the seed decides";
  EXPECT_EQ(e.starts[5].distance_mm, 0);
}

TEST_F(ExperimentFiles, SimulatedCasesDrawTheirInputs) {
  const Experiment e =
      read_good(kHead +
                "cases: {simulate: {pipeline: s.yaml, seeds: 3..5, set: {c.word: two}, draw: {x: [-2, 2]}, "
                "seed_input: [shape]}}\n" +
                kVariants + kMetrics);
  ASSERT_EQ(e.cases.size(), 3u);
  EXPECT_EQ(marrow::compare::simulation_arguments_of(e, 0).overrides.at(0).key, "c.word");
  EXPECT_EQ(e.cases[2].name, "seed-5");
  EXPECT_EQ(e.cases[2].seed, 5u);
  const auto input = [&](std::size_t index, std::size_t i) {
    return marrow::compare::simulation_arguments_of(e, index).inputs.at(i);
  };
  EXPECT_EQ(input(2, 1).name + "=" + input(2, 1).value, "shape=5");
  EXPECT_LE(std::abs(std::stod(input(2, 0).value)), 2);
  EXPECT_NE(input(1, 0).value, input(2, 0).value);
  EXPECT_EQ(input(1, 0).value, input(1, 0).value) << "the seed decides";
}

TEST_F(ExperimentFiles, AnInputMayBeAnEnvironmentVariable) {
  setenv("MARROW_TEST_SHAPE", "7", 1);
  const Experiment e =
      read(kHead + "cases: {simulate: {pipeline: s.yaml, seeds: 1..2, inputs: {shape: $env:MARROW_TEST_SHAPE}}}\n" +
           kVariants + kMetrics);
  unsetenv("MARROW_TEST_SHAPE");
  ASSERT_TRUE(diagnostics.empty()) << diagnostics.text();
  const marrow::InputValue shape = marrow::compare::simulation_arguments_of(e, 0).inputs.at(0);
  EXPECT_EQ(shape.name + "=" + shape.value, "shape=7");
}

TEST_F(ExperimentFiles, SeedsAloneAreThoseOfTheRuns) {
  const Experiment e = read(kHead + "cases: {seeds: [4, 9]}\ninputs: {case: cases/a}\n" + kVariants + kMetrics);
  ASSERT_EQ(e.cases.size(), 2u);
  EXPECT_EQ(e.cases[1].name, "seed-9");
  EXPECT_FALSE(e.cases[1].is_simulated);
  EXPECT_EQ(marrow::compare::arguments_of(e, {0, 1, 0}, {}).inputs.size(), 1u) << "no folder is given to an input";
  const marrow::compare::CellRunner runner(e, test_catalogue(), nullptr, scratch.path, 1);
  EXPECT_EQ(runner.seed_of(1), 9u);
}

TEST_F(ExperimentFiles, APipelineThatMakesItsDataTakesItsInputsBySeed) {
  scratch.write(
      "p.yaml",
      "marrow: 1\ninputs: {x: {type: number, default: 0}, shape: {type: integer, default: 1}}\nnodes:\n"
      "  c: {uses: test.constant, with: {value: $x, count: $shape}}\n  n: {uses: test.add, in: {a: c, b: c}}\n"
      "outputs: {number: n}\n");
  const Experiment e =
      read_good(kHead + "cases: {seeds: 3..5, draw: {x: [-2, 2]}, seed_input: [shape]}\n" + kVariants + kMetrics);
  const auto input = [&](std::size_t index, std::size_t i) {
    return marrow::compare::arguments_of(e, {0, index, 0}, {}).inputs.at(i);
  };
  EXPECT_EQ(input(2, 1).name + "=" + input(2, 1).value, "shape=5");
  EXPECT_EQ(input(1, 0).name, "x");
  EXPECT_NE(input(1, 0).value, input(2, 0).value);
  EXPECT_EQ(marrow::compare::arguments_of(e, {1, 2, 0}, {}).inputs.at(0).value, input(2, 0).value)
      << "the same for each variant";
}

TEST_F(ExperimentFiles, PathsStartAtTheExperiment) {
  scratch.write("data.txt", "1");
  std::string pipeline = kPipeline;
  pipeline.insert(pipeline.find("{case:") + 1, "file: {type: path}, ");
  pipeline.replace(pipeline.find("path: $case"), 11, "path: $file");
  scratch.write("p.yaml", pipeline);
  const Experiment e =
      read_good(kStart + "inputs: {file: data.txt}\nvariants:\n  one: {}\n  two: {c.path: cases/a}\n" + kMetrics);
  const auto path = [&](std::size_t variant) {
    const auto p =
        marrow::read_pipeline(e.pipeline, marrow::compare::arguments_of(e, {variant, 0, 0}, e.cases[0].folder),
                              test_catalogue(), diagnostics);
    return std::get<std::string>(p.nodes[0].options.back());
  };
  EXPECT_EQ(path(0), (scratch.path / "data.txt").string())
      << "the folder where the program was started does not matter";
  EXPECT_EQ(path(1), (scratch.path / "cases/a").string());
}

TEST_F(ExperimentFiles, WhatIsNoFolderIsNoCase) {
  scratch.write("cases/notes.txt", "none");
  EXPECT_EQ(read(kStart + kVariants + kMetrics).cases.size(), 2u);
}

}  // namespace experiment_test
