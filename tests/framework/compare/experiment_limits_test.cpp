// SPDX-License-Identifier: Apache-2.0
// Too large experiments are reported before any part of them is made. Names that become folders fit every file system.
#include <ctime>

#include "experiment_files.hpp"
#include "marrow/compare/cell.hpp"
#include "marrow/runtime/pipeline/pipeline_names.hpp"

namespace experiment_limits_test {

namespace fs = std::filesystem;
using namespace experiment_files;

const std::string kGood = kStart + kVariants + kMetrics;

class ExperimentLimits : public ExperimentFiles {
 protected:
  /// Exactly this fault, found quickly.
  void expect_fault(const std::string& text, const std::string& fault) {
    const std::clock_t start = std::clock();
    read(text);
    const double seconds =
        double(std::clock() - start) / CLOCKS_PER_SEC;  // of this process, whatever else the machine does
    ASSERT_EQ(diagnostics.size(), 1u) << diagnostics.text().substr(0, 2000);
    EXPECT_HAS(diagnostics.text(), fault);
    EXPECT_LT(seconds, marrow::abi_stamp().sanitizers ? 60 : 20);
  }
  std::string matrix(int keys, int values) {
    static const char* const kOptions[] = {"c.value", "f.value",   "n.scale", "c.count",
                                           "c.word",  "c.numbers", "t.x",     "t.y"};
    std::string text = kStart + kMetrics + "matrix:\n", list;
    for (int i = 0; i < values; ++i) list += (i ? ", " : "") + std::to_string(i);
    for (int i = 0; i < keys; ++i) text += std::string("  ") + kOptions[i] + ": [" + list + "]\n";
    return text;
  }
};

TEST_F(ExperimentLimits, VariantsOfAMatrixOrByName) {
  expect_fault(matrix(8, 10), "e.yaml:5:1: error: the matrix makes 100000000 variants, at most 1000 can be compared");
  EXPECT_HAS(diagnostics.text(), "hint: leave values out, or name the combinations that matter under  variants:");
  expect_fault(matrix(8, 1000), "the matrix makes 1e+24 variants");
  expect_fault(matrix(1, 1001), "the matrix makes 1001 variants");
  EXPECT_EQ(read(matrix(1, 1000)).variants.size(), 1000u) << diagnostics.text().substr(0, 2000);
  std::string text = kStart + kMetrics + "variants:\n";
  for (int i = 0; i < 1001; ++i) text += "  v" + std::to_string(i) + ": {}\n";
  expect_fault(text, "e.yaml:5:1: error: there are 1001 variants, at most 1000 can be compared");
}

TEST_F(ExperimentLimits, CellsAndMetrics) {
  add_displaced_node();
  const std::string cases = kHead + "cases: {seeds: 1..100000}\ninputs: {case: cases/a}\n" + kMetrics;
  expect_fault(
      cases + kVariants + "starts: {node: s, count: 6, rotation_deg: 1}\n",
      "e.yaml:1:1: error: 2 variants, 100000 cases and 6 starts are 1200000 cells, at most 1000000 can be compared\n");
  EXPECT_HAS(diagnostics.text(), "hint: take fewer of them, or make several experiments");
  expect_fault(cases + kVariants + "starts: {node: s, count: 100000, rotation_deg: 1}\n", "are 20000000000 cells");
  EXPECT_EQ(read(cases + kVariants + "starts: {node: s, count: 5, rotation_deg: 1}\n").cell_count(), 1000000u)
      << diagnostics.text();
  std::string metrics = "metrics:\n";
  for (int i = 0; i < 200000; ++i) metrics += "- a.f" + std::to_string(i) + "\n";
  expect_fault(kStart + kVariants + metrics,
               "e.yaml:7:1: error: 'metrics' names 200000 figures, at most 1000 can be compared");
}

TEST_F(ExperimentLimits, SeedsAtTheEndOfTheIntegers) {
  const std::string ranges = "'seeds' must be a range such as 1..20, of at most 100000, or a list of integers";
  for (const char* wrong : {"9223372036854775800..9223372036854775807999", "99999999999999999999..99999999999999999999",
                            "18446744073709551610..18446744073709551615", "1..2x", "1...3", "1 ..3", "+1..3", "0x1..3",
                            "1..3..5", "1..100001", "1xx3", "1.x3", "1x.3", "xx3", "..3", "1..", "12"})
    expect_fault(kHead + "cases: {seeds: " + wrong + "}\ninputs: {case: cases/a}\n" + kVariants + kMetrics, ranges);
  const auto e = read(kHead + "cases: {seeds: 9223372036854775800..9223372036854775807}\ninputs: {case: cases/a}\n" +
                      kVariants + kMetrics);
  ASSERT_EQ(e.cases.size(), 8u) << diagnostics.text();
  EXPECT_EQ(e.cases.back().seed, 9223372036854775807u);
  expect_fault(kHead + "cases: {simulate: {pipeline: s.yaml, seeds: 1..3, draw: {x: [-1.7e308, 1.7e308]}}}\n" +
                   kVariants + kMetrics,
               "the range of 'x' is too wide for a number to be drawn from it");
}

TEST_F(ExperimentLimits, AHundredThousandCasesAreReadAtOnce) {
  const std::clock_t start = std::clock();
  const auto e =
      read(kHead + "cases: {simulate: {pipeline: s.yaml, seeds: 1..100000, draw: {x: [0, 1]}, seed_input: [shape]}}\n" +
           kVariants + kMetrics);
  EXPECT_EQ(e.cases.size(), 100000u) << diagnostics.text();
  EXPECT_EQ(marrow::compare::cell_of(e, "two/seed-99999/0")->case_index, 99998u);
  EXPECT_LT(double(std::clock() - start) / CLOCKS_PER_SEC, 20) << "with quadratic work it takes minutes";
}

TEST_F(ExperimentLimits, NamesThatAreTooLongForAFolder) {
  const std::string longest(100, 'n'), longer(101, 'n');
  EXPECT_EQ(read(kStart + kMetrics + "variants:\n  " + longest + ": {}\n").variants.size(), 1u) << diagnostics.text();
  expect_fault(kStart + kMetrics + "variants:\n  " + longer + ": {}\n",
               "e.yaml:6:3: error: a variant's name becomes a file name: '");
  EXPECT_HAS(diagnostics.text(), "it has 101 bytes");
  expect_fault(kGood + "name: " + std::string(260, 'n') + "\n", "an experiment's name becomes a file name");
  fs::create_directories(scratch.path / "cases" / longer);
  expect_fault(kGood, "e.yaml:3:19: error: a case's name becomes a file name");
}

TEST_F(ExperimentLimits, NamesThatTheMatrixComposes) {
  expect_fault(kStart + kMetrics + "matrix:\n  c.path: [" + std::string(60, 'a') + ", b]\n  c.value: [1, " +
                   std::string(40, '0') + "2]\n",
               "e.yaml:5:1: error: the matrix makes a variant's name of 102 bytes of its values; as a folder's name it "
               "may have 100\n");
  EXPECT_HAS(diagnostics.text(), "hint: name the combinations under  variants:");
  // Each variant has its own folder, for any values.
  const auto e = read(kStart + kMetrics + "matrix:\n  c.path: [two, TWO, 'two', two-2, 'a b', a_b]\n");
  EXPECT_EQ(marrow::names_of(e.variants), (std::vector<std::string>{"two", "TWO-3", "two-4", "two-2", "a_b", "a_b-2"}))
      << diagnostics.text();
}

TEST_F(ExperimentLimits, NamesThatAreOneFolderToSomeFileSystems) {
  expect_fault(kStart + kMetrics + "variants:\n  canny: {}\n  Canny: {}\n",
               "e.yaml:7:3: error: the variants 'canny' and 'Canny' are one folder to some file systems\n");
  fs::create_directories(scratch.path / "cases" / "A");
  expect_fault(kGood, "e.yaml:3:19: error: two cases are named 'a' and 'A', which is one folder to some file systems");
}

TEST_F(ExperimentLimits, FoldersWithOddNames) {
  for (const char* name : {"with space", "line\nbreak", "esc\x1b[31m", "not\xffutf8", ".hidden"})
    fs::create_directories(scratch.path / "odd" / name);
  const auto e = read_good(kHead + "cases: {folders: [odd/*, odd/.hidden]}\n" + kVariants + kMetrics);
  EXPECT_EQ(marrow::names_of(e.cases),
            (std::vector<std::string>{"esc%1B[31m", "line%0Abreak", "not%FFutf8", "with space", "%2Ehidden"}));
  EXPECT_EQ(e.cases[1].folder, scratch.path / "odd" / "line\nbreak");
}

TEST_F(ExperimentLimits, FoldersThatCannotBeFound) {
  const auto folders = [](const std::string& pattern) {
    return kHead + "cases:\n  folders:\n  - " + pattern + "\n" + kVariants + kMetrics;
  };
  expect_fault(folders(std::string(65536, 'a')), "e.yaml:5:5: error: the cases at '");
  EXPECT_HAS(diagnostics.text(), "more than any path may have");
  std::string deep;
  for (int i = 0; i < 32768; ++i) deep += "*/";
  expect_fault(folders("'" + deep + "'"), "more than any path may have");
  fs::create_directory_symlink(scratch.path / "nowhere", scratch.path / "cases" / "c");
  expect_fault(kGood, "e.yaml:3:19: error: the link " + (scratch.path / "cases" / "c").string() + " leads nowhere");
  fs::remove(scratch.path / "cases" / "c");
  fs::create_directory_symlink("itself", scratch.path / "cases" / "itself");
  expect_fault(kGood, "leads nowhere");
}

TEST_F(ExperimentLimits, LinksInACircleEnd) {
  for (int i = 0; i < 10; ++i) fs::create_directory_symlink(".", scratch.path / "cases" / ("l" + std::to_string(i)));
  expect_fault(kHead + "cases: {folders: [cases/*/*/*/*/*/*/*/*/*/*/*/*]}\n" + kVariants + kMetrics,
               "the search goes through more than 300000 files and folders; do links lead in a circle?");
}

TEST_F(ExperimentLimits, ManyFolders) {
  for (int i = 0; i < 3000; ++i) fs::create_directory(scratch.path / "cases" / ("case-" + std::to_string(i)));
  EXPECT_EQ(read(kGood).cases.size(), 3002u) << diagnostics.text();
}

TEST_F(ExperimentLimits, TheFileItself) {
  const auto fault = [&](const fs::path& file) {
    diagnostics = marrow::Diagnostics();
    marrow::compare::read_experiment(file, test_catalogue(), diagnostics);
    return diagnostics.text();
  };
  EXPECT_HAS(fault(scratch.path), "error: the experiment file is a folder, not a regular file");
  EXPECT_HAS(fault("/dev/zero"), "error: the experiment file is a device, not a regular file");
  const std::string named = scratch.write("...yaml", kGood).string();
  EXPECT_HAS(fault(named),
             "the experiment is named after its file, which becomes a folder's name: '..' cannot be "
             "one, it begins with a dot");
  EXPECT_EQ(fault(scratch.write("...yaml", kGood + "name: good\n")), "");
}

TEST_F(ExperimentLimits, AVariantWhoseOutputIsNoFigure) {
  scratch.write("p.yaml",
                "marrow: 1\ninputs: {case: {type: path, default: x}}\nnodes:\n  m: {uses: test.constant}\noutputs: "
                "{number: m}\n");
  expect_fault(kStart + kMetrics + "variants:\n  one: {}\n  two: {m.uses: test.truth}\n",
               "e.yaml:7:3: error: in variant 'two' output 'number' is truth, not figures of merit");
}

// Texts and numbers of an experiment on their way into the pipeline: they arrive as they are written or drawn.

using marrow::compare::Experiment;

const std::string kUnvaried = kStart + kMetrics;  // lines 1 to 4

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
    EXPECT_EQ(path_in(read(kUnvaried + "variants: {v: " + change + "}\n"), 0), wanted) << text;
    EXPECT_EQ(path_in(read(kUnvaried + kVariants + "set: " + change + "\n"), 1), wanted) << text;
    EXPECT_EQ(path_in(read(kUnvaried + "variants: {v: {}}\nmatrix: {c.path: [x, '" + text + "']}\n"), 1), wanted)
        << text;
  }
}

TEST_F(ExperimentTexts, TextsAndPathsThatAreMissingAreFaults) {
  const std::string hint = "an empty text is written as ''";
  expect_fault(kUnvaried + "variants: {v: {c.path: }}\n", 5, "'c.path' has no value", hint);
  expect_fault(kUnvaried + "variants: {v: {}}\nmatrix: {c.path: [x, ~]}\n", 6, "'c.path' has no value", hint);
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
    expect_fault(kUnvaried + "variants:\n  one: {}\n  \"" + name + "\": {}\n", 7,
                 "the key '" + name + "' in 'variants' holds " + what, "write it without");
    expect_fault(kHead + kCases + kVariants + "metrics: [{figure: number.value, label: \"" + name + "\"}]\n", 7,
                 "the label '" + name + "' holds " + what, "write it without");
  }
  std::filesystem::create_directories(scratch.path / "cases" / "a\u200b");
  const Experiment experiment = read(kUnvaried + kVariants);
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
  const Experiment swept =
      read_good(kUnvaried + "sweep: {options: {c.value: {range: [0.1, 700], scale: log}}, grid: 7}\n");
  for (std::size_t i = 0; i < 7; ++i) {
    const auto& variant = swept.variants[i];
    EXPECT_EQ(std::strtod(variant.overrides.at(0).value.c_str(), nullptr), variant.swept.at(0)) << variant.name;
    EXPECT_NEAR(variant.swept[0], 0.1 * std::pow(7000, double(i) / 6), 1e-12 * variant.swept[0]);
  }
  scratch.write("p.yaml",
                "marrow: 1\ninputs: {case: {type: path}}\nnodes:\n  c: {uses: test.constant, with: {path: $case}}\n"
                "  s: {uses: test.displaced}\noutputs: {number: c, s: s}\n");
  const Experiment started =
      read_good(kUnvaried + kVariants + "starts: {node: s, count: 9, rotation_deg: 3, distance_mm: 40}\n");
  for (std::size_t i = 0; i < 9; ++i) {
    const auto overrides = marrow::compare::arguments_of(started, {0, 0, i}, started.cases[0].folder).overrides;
    const std::string rotation = overrides.at(0).value;  // [a, b, c]
    char* end = const_cast<char*>(rotation.c_str());
    for (const double written : started.starts[i].rotation_deg)
      EXPECT_EQ(std::strtod(end + 1, &end), written) << rotation;
    EXPECT_EQ(std::strtod(overrides.at(2).value.c_str(), nullptr), started.starts[i].distance_mm);
  }
}

}  // namespace experiment_limits_test
