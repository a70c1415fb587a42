// SPDX-License-Identifier: Apache-2.0
// Texts and numbers of an experiment on their way into the pipeline: they arrive as they are written or drawn.
#include <cmath>
#include <cstdlib>
#include <set>

#include "experiment_files.hpp"

namespace experiment_texts_test {

using namespace experiment_files;
using marrow::compare::Experiment;

const std::string kGood = kStart + kMetrics;  // lines 1 to 4

class ExperimentTexts : public ExperimentFiles {
 protected:
  /// The option `path` of node c in a variant of the experiment, as the pipeline gets it.
  std::string path_in(const Experiment& experiment, std::size_t variant) {
    EXPECT_TRUE(diagnostics.empty()) << diagnostics.text();
    if (!diagnostics.empty()) return "";
    const marrow::PipelineArguments arguments =
        marrow::compare::arguments_of(experiment, {variant, 0, 0}, experiment.cases[0].folder);
    const marrow::Pipeline pipeline =
        marrow::read_pipeline(experiment.pipeline, arguments, test_catalogue(), diagnostics);
    EXPECT_TRUE(diagnostics.empty()) << diagnostics.text();
    return diagnostics.empty() ? std::get<std::string>(pipeline.nodes[0].options[6]) : "";
  }
};

/// By YAML's rules for quoted texts, each value is the text between the single quotes.
TEST_F(ExperimentTexts, ArriveAsTheyAre) {
  const std::vector<std::string> texts{"a #b", "&a b", "! b", "*a",     "- a",     "a: b",   "~",   "null",
                                       "%a",   "| a",  "[a",  "{a: b}", "\"a\" b", "[a] #b", " a ", "größe 漢"};
  for (const std::string& text : texts) {
    const std::string wanted = (scratch.path / text).string(), change = "{c.path: '" + text + "'}";
    EXPECT_EQ(path_in(read(kGood + "variants: {v: " + change + "}\n"), 0), wanted) << text;
    EXPECT_EQ(path_in(read(kGood + kVariants + "set: " + change + "\n"), 1), wanted) << text;
    EXPECT_EQ(path_in(read(kGood + "variants: {v: {}}\nmatrix: {c.path: [x, '" + text + "']}\n"), 1), wanted) << text;
  }
}

TEST_F(ExperimentTexts, ThatAreMissingAreFaults) {
  const std::string hint = "an empty text is written as ''";
  expect_fault(kGood + "variants: {v: {c.path: }}\n", 5, "'c.path' has no value", hint);
  expect_fault(kGood + "variants: {v: {}}\nmatrix: {c.path: [x, ~]}\n", 6, "'c.path' has no value", hint);
}

TEST_F(ExperimentTexts, EmptyPathsAreFaults) {
  const std::string rest = kVariants + kMetrics;
  expect_fault("experiment: 1\npipeline: ''\n" + (kCases + rest), 2, "'pipeline' is empty",
               "name a file; the path starts at the experiment's file");
  expect_fault(kHead + ("cases: {folders: ['']}\n" + rest), 3, "a folder of 'folders' is empty",
               "name a folder; that of the experiment's file is  .");
}

/// U+200B is a space of no width, U+00A0 one that does not break, U+0301 an accent beside its letter.
TEST_F(ExperimentTexts, NamesThatLookTheSameAreFaults) {
  for (const auto& [name, what] : std::vector<std::pair<std::string, std::string>>{
           {"one\u200b", "U+200B, which cannot be seen"},
           {"o\u00adne", "U+00AD, which cannot be seen"},
           {"\ufeffone", "U+FEFF, which cannot be seen"},
           {"one\u00a0a", "U+00A0, a blank that is not a space"},
           {"e\u0301", "U+0301, a mark of the letter before it; type the letter with its mark as one character"},
           {"\u202eone", "a control character"}}) {
    expect_fault(kGood + "variants:\n  one: {}\n  \"" + name + "\": {}\n", 7,
                 "the key '" + name + "' in 'variants' holds " + what, "write it without");
    expect_fault(kHead + kCases + kVariants + "metrics: [{figure: number.value, label: \"" + name + "\"}]\n", 7,
                 "the label '" + name + "' holds " + what, "write it without");
  }
  std::filesystem::create_directories(scratch.path / "cases" / "a\u200b");
  const Experiment experiment = read(kGood + kVariants);
  ASSERT_EQ(experiment.cases.size(), 3u) << diagnostics.text();
  EXPECT_EQ(experiment.cases[1].name, "a%E2%80%8B")
      << "an existing folder gets an escaped name, in which the character can be seen";
}

/// A draw from [0, 1) is a multiple of 2^-53 (the generator's definition), which no text of six digits is.
TEST_F(ExperimentTexts, DrawnNumbersKeepAllDigits) {
  const Experiment experiment =
      read(kHead + ("cases: {simulate: {pipeline: s.yaml, seeds: 1..40, draw: {x: [0, 1]}}}\n" + kVariants + kMetrics));
  std::set<std::string> texts;
  for (std::size_t i = 0; i < 40; ++i) {
    const std::string text = marrow::compare::simulation_arguments_of(experiment, i).inputs.at(0).value;
    const double value = std::strtod(text.c_str(), nullptr);
    EXPECT_EQ(std::ldexp(value, 53), std::trunc(std::ldexp(value, 53))) << text;
    texts.insert(text);
  }
  EXPECT_EQ(texts.size(), 40u);
}

/// An input of type integer takes only whole numbers, with any number of digits.
TEST_F(ExperimentTexts, WholeNumbersAreDrawnForIntegers) {
  const auto with = [](const std::string& range) {
    return kHead + ("cases: {simulate: {pipeline: s.yaml, seeds: 1..40, draw: {shape: " + range + "}}}\n") + kVariants +
           kMetrics;
  };
  const Experiment experiment = read_good(with("{range: [1000000, 9000000], whole: true}"));
  std::set<std::string> texts;
  for (std::size_t i = 0; i < 40; ++i) {
    texts.insert(marrow::compare::simulation_arguments_of(experiment, i).inputs.at(0).value);
    EXPECT_EQ(texts.rbegin()->size(), 7u);
    EXPECT_EQ(texts.rbegin()->find_first_not_of("0123456789"), std::string::npos);
  }
  EXPECT_EQ(texts.size(), 40u);
  expect_fault(with("{whole: true}"), 3, "'shape' has no range", "add  range: [-10, 10]");
}

TEST_F(ExperimentTexts, StartsAndSweptValuesAreThoseOfTheRecord) {
  const Experiment swept = read_good(kGood + "sweep: {options: {c.value: {range: [0.1, 700], scale: log}}, grid: 7}\n");
  for (std::size_t i = 0; i < 7; ++i) {
    const auto& variant = swept.variants[i];
    EXPECT_EQ(std::strtod(variant.overrides.at(0).value.c_str(), nullptr), variant.swept.at(0)) << variant.name;
    EXPECT_NEAR(variant.swept[0], 0.1 * std::pow(7000, double(i) / 6), 1e-12 * variant.swept[0]);
  }
  scratch.write("p.yaml",
                "marrow: 1\ninputs: {case: {type: path}}\nnodes:\n  c: {uses: test.constant, with: {path: $case}}\n"
                "  s: {uses: test.displaced}\noutputs: {number: c, s: s}\n");
  const Experiment started =
      read_good(kGood + kVariants + "starts: {node: s, count: 9, rotation_deg: 3, distance_mm: 40}\n");
  for (std::size_t i = 0; i < 9; ++i) {
    const auto overrides = marrow::compare::arguments_of(started, {0, 0, i}, started.cases[0].folder).overrides;
    const std::string rotation = overrides.at(0).value;  // [a, b, c]
    char* end = const_cast<char*>(rotation.c_str());
    for (const double written : started.starts[i].rotation_deg)
      EXPECT_EQ(std::strtod(end + 1, &end), written) << rotation;
    EXPECT_EQ(std::strtod(overrides.at(2).value.c_str(), nullptr), started.starts[i].distance_mm);
  }
}

}  // namespace experiment_texts_test
