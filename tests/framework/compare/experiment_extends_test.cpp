// SPDX-License-Identifier: Apache-2.0
// Experiments that extend others.
#include "experiment_files.hpp"

namespace experiment_extends_test {

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

}  // namespace experiment_extends_test
