// SPDX-License-Identifier: Apache-2.0
// A figure that no output can have is a fault of the experiment's file. The nodes declare the figures that they make.
#include "marrow/compare/experiment_figures.hpp"
#include "experiment_files.hpp"
#include "marrow/compare/cell.hpp"

namespace experiment_figures_test {

using experiment_files::ExperimentFiles;
using marrow::compare::Experiment;
using marrow::compare::NamedItem;

const marrow::Catalogue& catalogue() {
  static const marrow::Catalogue both({std::filesystem::path(MARROW_BINARY_DIR) / "tests" / "plugins",
                                       std::filesystem::path(MARROW_BINARY_DIR) / "tests" / "figure_plugins"});
  return both;
}

const char* const kPipeline =
    "marrow: 1\ninputs: {case: {type: path}}\nnodes:\n"
    "  f: {uses: test.fragments, with: {path: $case}}\n  plain: {uses: test.constant}\n"
    "  one: {uses: test.declared, in: {of: plain}}\n  each: {uses: test.declared, in: {of: f}}\n"
    "  w: {uses: test.way}\n  search: {uses: test.stages, in: {of: f, way: w}}\n"
    "  staged: {uses: test.declared, in: {of: search}}\n  free: {uses: test.undeclared, in: {of: f}}\n"
    "outputs: {one: one, each: each, staged: staged, free: free}\n";

class ExperimentFigures : public ExperimentFiles {
 protected:
  ExperimentFigures() : ExperimentFiles(catalogue()) {
    scratch.write("p.yaml", kPipeline);
    std::filesystem::create_directories(scratch.path / "case");
    scratch.write("case/fragments.txt", "distal\nproximal\n");
  }
  /// Lines 1 to 3; what is added begins in line 4.
  Experiment read(const std::string& text) {
    return ExperimentFiles::read("experiment: 1\npipeline: p.yaml\ncases: {folders: [case]}\n" + text);
  }
  Experiment with_metric(const std::string& path, const std::string& more = "variants: {a: {}}\n") {
    return read("metrics:\n  - " + path + "\n" + more);
  }
};

TEST_F(ExperimentFigures, AFigureThatTheNodeDoesNotDeclareAndOnesThatItDoes) {
  with_metric("one.mtre_m");
  expect_only_fault(5, "output 'one' (test.declared) has no figure 'mtre_m'", "did you mean 'mtre_mm'?");
  with_metric("each.distal.frontal.medianpx");
  expect_only_fault(5, "output 'each' (test.declared) has no figure 'frontal.medianpx'", "known: mtre_mm, *.median_px");
  read("metrics: [one.mtre_mm]\nvariants: {a: {}}\ninitial_error: one.start_mm\n");
  expect_only_fault(6, "output 'one' (test.declared) has no figure 'start_mm'", "known: mtre_mm, *.median_px");
  for (const char* path : {"one.mtre_mm", "one.frontal.median_px", "each.distal.mtre_mm",
                           "staged.distal.final.frontal.median_px", "free.distal.anything"}) {
    with_metric(path);
    EXPECT_TRUE(diagnostics.empty()) << path << diagnostics.text();
  }
}

TEST_F(ExperimentFigures, ThatNeedNoTruth) {
  const auto file =
      scratch.write("judged.yaml",
                    "marrow: 1\ninputs: {case: {type: path}}\nnodes:\n  t: {uses: test.truth}\n"
                    "  f: {uses: test.fragments, with: {path: $case}}\n  n: {uses: test.constant}\n"
                    "  judged: {uses: jury.test, in: {of: n, truth: t}}\n"
                    "  after: {uses: test.declared, in: {of: judged}}\n"
                    "  each: {uses: test.declared, in: {of: f}}\n  free: {uses: test.undeclared, in: {of: f}}\n"
                    "outputs: {truth: t, judged: judged, each: each, after: after, free: free}\n");
  marrow::Diagnostics faults;
  const marrow::Pipeline pipeline =
      marrow::read_pipeline(file, {{{"case", (scratch.path / "case").string()}}, {}}, nodes, faults);
  ASSERT_TRUE(faults.empty()) << faults.text();
  EXPECT_EQ(marrow::compare::figures_without_truth(pipeline),
            (std::vector<std::string>{"each.FRAGMENT.mtre_mm", "each.FRAGMENT.*.median_px", "free.FRAGMENT.*"}));
}

TEST_F(ExperimentFigures, APathWithTooFewParts) {
  with_metric("each.mtre_mm");
  expect_only_fault(5, "'each.mtre_mm' has too few parts: output 'each' is a list over fragment",
                    "write it as  each.FRAGMENT.mtre_mm");
  with_metric("staged.distal.mtre_mm");
  expect_only_fault(5, "'staged.distal.mtre_mm' has too few parts: output 'staged' is a list over fragment and stage",
                    "write it as  staged.FRAGMENT.STAGE.mtre_mm");
  with_metric("staged");
  expect_only_fault(5, "'staged' does not say which figure", "write it as  staged.FRAGMENT.STAGE.FIGURE");
}

TEST_F(ExperimentFigures, EachVariantsOwnNode) {
  with_metric("one.value", "variants:\n  a: {one.uses: test.undeclared}\n  b: {}\n  c: {}\n");
  ASSERT_EQ(diagnostics.size(), 2u) << diagnostics.text();
  EXPECT_EQ(diagnostics.sorted()[0].place.line, 5);
  EXPECT_EQ(diagnostics.sorted()[0].message, "in variant 'b' output 'one' (test.declared) has no figure 'value'");
  with_metric("one.value");  // of the first variant, it is said once
  with_metric("one.value", "variants: {a: {}, b: {}}\n");
  expect_only_fault(5, "output 'one' (test.declared) has no figure 'value'", "known: mtre_mm, *.median_px");
}

TEST_F(ExperimentFigures, ItemsThatTheCaseNames) {
  const Experiment experiment = with_metric("staged.dital.finl.mtre_mm");
  ASSERT_TRUE(diagnostics.empty()) << diagnostics.text();
  // A search makes the stages, so only the fragments can be looked up: test.fragments needs no other node.
  ASSERT_EQ(experiment.named_items.size(), 1u);
  const NamedItem& item = experiment.named_items[0];
  EXPECT_EQ(item.item, "dital");
  EXPECT_EQ(item.axis, "fragment");
  EXPECT_EQ(item.node, "f");
  EXPECT_EQ(item.place.line, 5);
  marrow::compare::CellRunner runner(experiment, catalogue(), nullptr, scratch.path / "out", 1);
  EXPECT_EQ(runner.items_of({0, 0, 0}, item), (std::vector<std::string>{"distal", "proximal"}));
}

TEST_F(ExperimentFigures, VariantsWithTheSameNodeAreAskedOnceAndLimitsChecked) {
  const std::string path = "metrics: [each.distal.mtre_mm, each.distal.frontal.median_px]\n";
  EXPECT_EQ(read(path + "variants: {a: {}, b: {plain.value: 2}, c: {each.uses: test.undeclared}}\n").named_items.size(),
            2u);  // one for each path
  EXPECT_EQ(read(path + "variants: {a: {}, b: {f.path: elsewhere}}\n").named_items.size(), 4u);
  read("metrics: [{figure: one.mtre_mm, better: nearest_zero}]\nsuccess:\n  one.mtre_mm: -1\nvariants: {a: {}}\n");
  expect_only_fault(6, "the limit of 'one.mtre_mm' is -1, but its magnitude counts, which is never below 0", "");
}

const std::string kSeeds = "experiment: 1\npipeline: s.yaml\n";

class ExperimentNotes : public ExperimentFiles {
 protected:
  ExperimentNotes() : ExperimentFiles(catalogue()) {
    scratch.write("s.yaml", "marrow: 1\nnodes:\n  d: {uses: test.draw}\noutputs: {number: d}\n");
  }
  std::vector<std::string> notes(const std::string& text) {
    const Experiment experiment = read_good(kSeeds + "metrics: [number.value]\n" + text);
    return diagnostics.empty() ? marrow::compare::notes_of(experiment) : std::vector<std::string>();
  }
};

using Notes = std::vector<std::string>;

// The least p of n differences that all have one sign is 2 / 2^n. Holm multiplies the smallest of k by k. For ten,
// 10 * 2 / 2^8 = 0.078 and 10 * 2 / 2^9 = 0.039; for one, 2 / 2^5 = 0.0625 and 2 / 2^6 = 0.031.
TEST_F(ExperimentNotes, TooFewCasesForADifference) {
  std::string variants = "variants: {v0: {}";
  for (int v = 1; v <= 10; ++v) variants += ", v" + std::to_string(v) + ": {}";
  variants += "}\n";
  EXPECT_EQ(notes("cases: {seeds: 1..8}\n" + variants),
            (Notes{"8 cases cannot show a difference among 10 comparisons: even if all go the same way, p stays above "
                   "0.05 after Holm's correction; it takes at least 9"}));
  EXPECT_EQ(notes("cases: {seeds: 1..9}\n" + variants), Notes{});
  EXPECT_EQ(notes("cases: {seeds: 1..5}\nvariants: {a: {}, b: {}}\n"),
            (Notes{"5 cases cannot show a difference: even if all go the same way, p stays above 0.05; it takes at "
                   "least 6"}));
  EXPECT_EQ(notes("cases: {seeds: 1..6}\nvariants: {a: {}, b: {}}\n"), Notes{});
  EXPECT_EQ(notes("cases: {seeds: [1]}\nvariants: {a: {}}\n"), Notes{}) << "nothing is compared";
}

TEST_F(ExperimentNotes, ARuleThatCanNeverBeMet) {
  const auto with_stop = [&](const std::string& rule) {
    return notes("cases: {seeds: 1..4}\nvariants: {a: {}}\nsuccess: {number.value: 1e9}\nstop: {" + rule +
                 ", look_every: 1}\n");
  };
  // One look, so its level is alpha: 5 cases hold a median with 1 - 2 / 2^5 = 94 % at most.
  EXPECT_EQ(notes("cases: {seeds: 1..5}\nvariants: {a: {}}\nstop: {figure: number.value, width: 1, most_cases: 5, "
                  "look_every: 1}\n"),
            (Notes{"the rule under 'stop' can never be met: at its last look, at 5 cases, there is no interval of a "
                   "median with its confidence, which takes at least 6 cases"}));
  EXPECT_EQ(with_stop("figure: number.value, width: 1, most_cases: 40"), Notes{});
  // Wilson's interval of n successes in n runs begins at n / (n + z^2): 40 / (40 + 3.84) = 0.91 even for one look.
  const Notes narrow = with_stop("figure: success, width: 0.05, most_cases: 40");
  ASSERT_EQ(narrow.size(), 1u);
  EXPECT_HAS(narrow[0], "can never be met: at its last look, at 40 cases, the interval of a success rate is at least");
  EXPECT_EQ(with_stop("figure: success, width: 0.5, most_cases: 40"), Notes{});
}

TEST_F(ExperimentNotes, ADifferenceThatCanNeverBeShown) {
  EXPECT_EQ(notes("cases: {seeds: 1..5}\nvariants: {a: {}, b: {}}\nstop: {difference: number.value, most_cases: 5, "
                  "look_every: 1}\n"),
            (Notes{"5 cases cannot show a difference: even if all go the same way, p stays above 0.05; it takes at "
                   "least 6",
                   "the rule under 'stop' can never be met: at its last look, at 5 cases, p must be below 0.05, which "
                   "takes at least 6 cases"}));
}

TEST_F(ExperimentNotes, ACaptureRangeWithoutSuccess) {
  const std::string start = "cases: {seeds: 1..2}\nvariants: {a: {}}\ninitial_error: number.value\n";
  EXPECT_EQ(notes(start),
            (Notes{"there is no capture range over 'number.value': without limits under 'success', no run "
                   "is a success or a miss"}));
  EXPECT_EQ(notes(start + "success: {number.value: 2}\n"), Notes{});
}

TEST_F(ExperimentNotes, CountsOfComparisons) {
  const Experiment experiment =
      read(kSeeds + "metrics: [number.value]\ncases: {seeds: 1..8}\nvariants: {a: {}, b: {}, c: {}}\n");
  const auto counts = marrow::compare::comparison_counts(experiment);
  EXPECT_EQ(counts.comparisons, 2u);
  EXPECT_EQ(counts.cases, 8u);
  EXPECT_EQ(counts.fewest_cases, 7u);  // 2 * 2 / 2^6 = 0.0625, 2 * 2 / 2^7 = 0.031
}

}  // namespace experiment_figures_test
