// SPDX-License-Identifier: Apache-2.0
#include <sys/mman.h>

#include "marrow/runtime/run/output_faults.hpp"
#include "marrow/runtime/run/run_folder.hpp"
#include "tests/framework/run_fixture.hpp"

namespace executor_test {

using namespace marrow;
using test::message_of;
using Status = NodeRecord::Status;

class ExecutorTest : public run_fixture::RunTest {
 protected:
  double drawn(const std::string& node, std::uint64_t seed) {
    settings.seed = seed;
    return result_of(run("  " + node + ": {uses: test.draw}\n", "o: " + node));
  }
};

TEST_F(ExecutorTest, AddsAlongTheGraph) {
  const RunResult result =
      run("  c: {uses: test.constant, with: {value: 5}}\n  a: {uses: test.add, in: {a: c, b: c}}\n  d: {uses: "
          "test.add, in: {a: a, b: c}}\n",
          "o: d");
  EXPECT_FALSE(result.failed());
  EXPECT_EQ(result_of(result), 15);
}

TEST_F(ExecutorTest, MapsOverListsInStepAndNested) {
  const RunResult result =
      run("  s: {uses: test.sides}\n  l: {uses: test.letters}\n  step: {uses: test.add, in: {a: s.both, b: s.both}}\n"
          "  nest: {uses: test.add, in: {a: s.both, b: l}}\n  sum: {uses: test.sum, in: {items: nest}}\n",
          "step: step, nest: nest, sum: sum");
  const Value step = output(result, 0);
  ASSERT_EQ(step.names, (std::vector<std::string>{"a", "b"}));
  EXPECT_EQ(step.type, TypeInfo::of<Metrics>());
  EXPECT_EQ(number_of(step.items[1]), 40);
  const Value nest = output(result, 1);
  ASSERT_EQ(nest.axis, "side");
  ASSERT_EQ(nest.items[0].axis, "letter");
  EXPECT_EQ(number_of(nest.items[1].items[2]), 320);
  const Value sum = output(result, 2);
  ASSERT_EQ(sum.axis, "letter");
  EXPECT_EQ(number_of(sum.items[0]), 10 + 100 + 20 + 100);
}

TEST_F(ExecutorTest, PicksOneItemByName) {
  EXPECT_EQ(result_of(run("  s: {uses: test.sides}\n  a: {uses: test.add, in: {a: s.both.b}}\n", "o: a")), 20);
  const RunResult result = run(
      "  s: {uses: test.sides, with: {names: [left, right]}}\n  a: {uses: test.add, in: {a: s.both.rigth}}\n", "o: a");
  EXPECT_TRUE(result.failed());
  EXPECT_HAS(event_text(RunEvent::Kind::failed), "there is no 'rigth' along the axis 'side'; did you mean 'right'?")
      << event_text(RunEvent::Kind::failed);
}

TEST_F(ExecutorTest, ListLiteralAndListOfOne) {
  EXPECT_EQ(
      result_of(run("  c: {uses: test.constant, with: {value: 5}}\n  s: {uses: test.sides}\n  n: {uses: test.sum, "
                    "in: {items: [c, s.right]}}\n",
                    "o: n")),
      7);
  EXPECT_EQ(
      result_of(run("  c: {uses: test.constant, with: {value: 5}}\n  n: {uses: test.sum, in: {items: c}}\n", "o: n")),
      5);
}

TEST_F(ExecutorTest, ListsOutOfStepAreAFault) {
  const RunResult result =
      run("  s: {uses: test.sides}\n  t: {uses: test.sides, with: {names: [a, c]}}\n  a: {uses: test.add, in: {a: "
          "s.both, b: t.both}}\n",
          "o: a");
  EXPECT_TRUE(result.failed());
  EXPECT_HAS(event_text(RunEvent::Kind::failed),
             "inputs 'a' and 'b' do not go in step along 'side': the first has (a, b), the second (a, c)")
      << event_text(RunEvent::Kind::failed);
}

TEST_F(ExecutorTest, FailureNamesNodeInputsAndReasonAndLeavesOthersGoing) {
  const RunResult result =
      run("  s: {uses: test.sides}\n  f: {uses: test.fail_above, in: {a: s.both}, with: {value: 15}}\n  g: {uses: "
          "test.add, in: {a: f}}\n"
          "  n: {uses: test.sum, in: {items: f}}\n  c: {uses: test.constant}\n",
          "g: g, n: n, c: c");
  EXPECT_TRUE(result.failed());
  EXPECT_EQ(
      event_text(RunEvent::Kind::failed),
      "node 'f' (test.fail_above) for b failed: the number is too large; give a smaller one (its inputs: a = s.both)");
  const Value g = output(result, 0);
  EXPECT_EQ(number_of(g.items[0]), 10) << "the item that did not fail goes on";
  EXPECT_EQ(g.items[1].missing, "node 'f' failed");
  EXPECT_EQ(result.nodes[3].status, Status::not_run);
  EXPECT_EQ(result_of(result, 2), 1);
}

TEST_F(ExecutorTest, WhatIsBehindAFailureNamesItsFirstCauseAndIsCounted) {
  const RunResult result =
      run("  c: {uses: test.constant}\n  f: {uses: test.fail_above, in: {a: c}, with: {value: 0}}\n"
          "  g: {uses: test.add, in: {a: f}}\n  h: {uses: test.add, in: {a: g}}\n  i: {uses: test.add, in: {a: h}}\n",
          "i: i, c: c");
  EXPECT_EQ(result.nodes[1].stopped, 3);
  EXPECT_EQ(result.nodes[0].stopped, 0);
  for (const int node : {2, 3, 4}) {
    EXPECT_TRUE(result.nodes[std::size_t(node)].was_stopped());
    EXPECT_EQ(result.nodes[std::size_t(node)].reason, "node 'f' failed");
  }
  EXPECT_EQ(not_run_text(3), "3 nodes were not run because of it");
  EXPECT_EQ(not_run_text(1), "1 node was not run because of it");
}

TEST_F(ExecutorTest, WhatIsNotThereIsSkippedAndNoFailure) {
  const RunResult result =
      run("  s: {uses: test.sides}\n  a: {uses: test.add, in: {a: s.maybe}}\n  b: {uses: test.add, in: {a: s.left, b: "
          "s.maybe}}\n",
          "a: a, b: b");
  EXPECT_FALSE(result.failed());
  EXPECT_TRUE(output(result, 0).is_absent());
  EXPECT_EQ(result_of(result, 1), 1) << "an optional input may be absent";
  EXPECT_EQ(event_text(RunEvent::Kind::skipped), "there is no 'a'");
}

TEST_F(ExecutorTest, OnlyWhatTheOutputsNeedRuns) {
  const RunResult result = run("  c: {uses: test.constant}\n  d: {uses: test.draw}\n", "o: c");
  EXPECT_EQ(result.nodes[1].status, Status::not_needed);
}

TEST_F(ExecutorTest, GivenValuesAreNotComputedAgain) {
  const std::string nodes =
      "  c: {uses: test.constant, with: {value: 5}}\n  d: {uses: test.add, in: {a: c, b: c}}\n  e: {uses: test.add, "
      "in: {a: d, b: d}}\n";
  const RunResult first = run(nodes, "o: e");
  settings.given["d"] = first.nodes[1].outputs;
  const RunResult second = run(nodes, "o: e");
  EXPECT_EQ(result_of(second), 20);
  EXPECT_EQ(second.nodes[0].status, Status::not_needed);
  EXPECT_EQ(second.nodes[1].status, Status::not_needed);
}

TEST_F(ExecutorTest, GivenValuesWithoutKeysAreToldApartByContent) {
  const auto made = [](double value) {
    return Value::of<Metrics>(std::make_shared<const Metrics>(Metrics{{{"value", value, ""}}}));
  };
  settings.given["c"] = {made(1)};
  settings.given["d"] = {made(2)};
  const RunResult result =
      run("  c: {uses: test.constant}\n  d: {uses: test.constant}\n  e: {uses: test.add, in: {a: c}}\n  f: {uses: "
          "test.add, in: {a: d}}\n",
          "e: e, f: f");
  EXPECT_EQ(result_of(result, 0), 1);
  EXPECT_EQ(result_of(result, 1), 2);
}

TEST_F(ExecutorTest, SameRecipeIsComputedOnce) {
  const RunResult result =
      run("  a: {uses: test.constant, with: {value: 3}}\n  b: {uses: test.constant, with: {value: 3}}\n  c: {uses: "
          "test.constant, with: {value: 4}}\n",
          "a: a, b: b, c: c");
  EXPECT_EQ(result.nodes[0].calls + result.nodes[1].calls + result.nodes[2].calls, 2);
  EXPECT_EQ(output(result, 0).data, output(result, 1).data);
}

TEST_F(ExecutorTest, KeysFollowContentNotRecipe) {
  const RunResult first = run("  c: {uses: test.constant, with: {value: 3}}\n", "o: c");
  const Digest key = output(first).key;
  EXPECT_EQ(
      key,
      output(run("  z: {uses: test.add, in: {a: y}}\n  y: {uses: test.constant, with: {value: 3}}\n", "o: z")).key);
  EXPECT_NE(key, output(run("  c: {uses: test.constant, with: {value: 4}}\n", "o: c")).key);
}

TEST_F(ExecutorTest, PathCountsByNameAndContent) {
  std::filesystem::create_directory(scratch.path / "below");
  const auto file = scratch.write("data.txt", "one"), copy = scratch.write("below/data.txt", "one");
  const std::string nodes = "  c: {uses: test.constant, with: {path: " + file.string() +
                            "}}\n  d: {uses: test.constant, with: {path: " + copy.string() + "}}\n";
  const RunResult same = run(nodes, "c: c, d: d");
  EXPECT_EQ(same.nodes[0].calls + same.nodes[1].calls, 1) << "the same in another folder";
  scratch.write("below/data.txt", "two");
  const RunResult changed = run(nodes, "c: c, d: d");
  EXPECT_EQ(changed.nodes[0].calls + changed.nodes[1].calls, 2);
}

TEST_F(ExecutorTest, FunctionKeepsItsInputsAlive) {
  const RunResult result =
      run("  c: {uses: test.constant, with: {value: 5}}\n  f: {uses: test.adder, in: {amount: c}}\n  a: {uses: "
          "test.apply, in: {adder: f, to: c}}\n",
          "a: a, f: f");
  EXPECT_EQ(result_of(result), 10);
  const Value function = output(result, 1);
  EXPECT_EQ(function.type.content, nullptr) << "a function has no content";
  EXPECT_NE(function.key, Digest{});
}

TEST_F(ExecutorTest, SeedDecidesRandomNodesAlone) {
  const double first = drawn("d", 1);
  EXPECT_EQ(first, drawn("other_name", 1)) << "a name changes nothing";
  EXPECT_NE(first, drawn("d", 2));
}

TEST_F(ExecutorTest, IndependentNodesOverlap) {
  // One after the other they would never begin less than half a second apart; a busy machine may let one of them wait.
  RunResult result;
  double apart_s = 1;
  for (int i = 0; i < 20 && apart_s >= 0.5; ++i) {
    result = run("  a: {uses: test.work, with: {value: 0.5}}\n  b: {uses: test.work, with: {value: 0.5000001}}\n",
                 "a: a, b: b");
    apart_s = std::abs(result.nodes[0].start_s - result.nodes[1].start_s);
  }
  EXPECT_LT(apart_s, 0.5);
}

TEST_F(ExecutorTest, TheLargestMemoryWhileANodeRanIsRecorded) {
  constexpr std::size_t kBytes = 200'000'000;
  void* held = nullptr;
  on_event = [&](const RunEvent& event) {
    if (event.node != "a" || event.kind != RunEvent::Kind::progress) return;
    if (event.fraction < 0.5 && !held)
      held = mmap(nullptr, kBytes, PROT_READ | PROT_WRITE, MAP_PRIVATE | MAP_ANONYMOUS | MAP_POPULATE, -1, 0);
    if (event.fraction > 0.5 && held) munmap(std::exchange(held, nullptr), kBytes);
  };
  const RunResult result = run("  a: {uses: test.work, with: {value: 1}}\n  b: {uses: test.add, in: {a: a}}\n", "b: b");
  EXPECT_GT(result.nodes[1].peak_memory_mb, 0);
  EXPECT_GT(result.nodes[0].peak_memory_mb, result.nodes[1].peak_memory_mb + 150);
}

TEST_F(ExecutorTest, CancelStopsWithinANode) {
  std::atomic<bool> stop{false};
  settings.cancelled = &stop;
  on_event = [&](const RunEvent& event) {
    if (event.node == "a" && event.kind == RunEvent::Kind::progress) stop = true;
  };
  const RunResult result =
      run("  c: {uses: test.constant}\n  a: {uses: test.work, in: {after: c}, with: {value: 60}}\n  b: {uses: "
          "test.add, in: {a: a}}\n",
          "b: b, c: c");
  EXPECT_TRUE(result.cancelled());
  EXPECT_FALSE(result.failed());
  EXPECT_LT(result.seconds, 50) << "the node works for a minute";
  EXPECT_EQ(result_of(result, 1), 1);
}

TEST_F(ExecutorTest, RunFolderRefusesToOverwrite) {
  run("  c: {uses: test.constant}\n", "o: c");
  scratch.write("something", "here");
  const std::string said = message_of([&] { RunFolder folder(scratch.path, pipeline); });
  EXPECT_HAS(said, "is already there and not empty; choose another with --out") << said;
  EXPECT_TRUE(std::filesystem::exists(scratch.path / "something"));
}

TEST_F(ExecutorTest, RunFolderThatCannotBeMade) {
  run("  c: {uses: test.constant}\n", "o: c");
  scratch.write("file", "");
  const std::string said = message_of([&] { RunFolder folder(scratch.path / "file" / "below", pipeline); });
  EXPECT_HAS(said, "cannot make the output folder") << said;
}

// The names of figures that a node declares: the declaration, the manifest, and a node that makes another figure.

const Catalogue& catalogue() {
  static const Catalogue figures({std::filesystem::path(MARROW_BINARY_DIR) / "tests" / "plugins",
                                  std::filesystem::path(MARROW_BINARY_DIR) / "tests" / "figure_plugins"});
  return figures;
}

TEST(FigureNames, AreInTheManifestAndAStarStandsForAnyText) {
  const NodeInfo* declared = catalogue().find("test.declared");
  ASSERT_TRUE(declared);
  EXPECT_EQ(declared->outputs[0].figures, (std::vector<std::string>{"mtre_mm", "*.median_px"}));
  EXPECT_TRUE(catalogue().find("test.undeclared")->outputs[0].figures.empty());
  PortInfo port;
  EXPECT_TRUE(may_have_figure(port, "anything")) << "nothing is known";
  port.figures = {"mtre_mm", "*.median_px", "median_*", "a*b*c"};
  for (const char* name : {"mtre_mm", "frontal.median_px", ".median_px", "a.b.median_px", "median_", "median_mtre_mm",
                           "abc", "a--b--c", "abbc"})
    EXPECT_TRUE(may_have_figure(port, name)) << name;
  for (const char* name : {"", "mtre_m", "mtre_mm2", "median.px", "frontal.median_pxx", "ab", "acb", "xabc"})
    EXPECT_FALSE(may_have_figure(port, name)) << name;
}

class FiguresOfARun : public run_fixture::RunTest {
 protected:
  const Catalogue& catalogue() const override { return executor_test::catalogue(); }
  RunResult run_also(const std::string& node, const std::string& also) {
    return run("  c: {uses: test.constant}\n  n: {uses: " + node + ", in: {of: c}, with: {also: " + also + "}}\n",
               "figures: n");
  }
};

TEST_F(FiguresOfARun, MustBeAmongTheDeclared) {
  const RunResult other = run_also("test.declared", "odd_mm");
  EXPECT_TRUE(other.failed());
  EXPECT_EQ(other.nodes.back().reason,
            "it gave an output 'metrics' that cannot be: the figure 'odd_mm' is not among those that its declaration "
            "names");
  EXPECT_FALSE(run_also("test.declared", "lateral.median_px").failed());
  EXPECT_FALSE(run_also("test.undeclared", "odd_mm").failed());
}

Metrics figures() { return {}; }
Pose pose() { return {}; }
std::vector<std::string> faults(const Plugin& plugin) { return plugin.nodes.back().faults; }

TEST(FigureNames, BelongToAnOutputOfFigures) {
  Plugin plugin;
  plugin.node("test.figures", figures).summary("s").out("metrics", "h").figures({"a", "b"});
  EXPECT_TRUE(faults(plugin).empty());
  EXPECT_EQ(plugin.nodes.back().info.outputs[0].figures, (std::vector<std::string>{"a", "b"}));
  plugin.node("test.pose", pose).summary("s").out("pose", "h").figures({"a"});
  EXPECT_EQ(faults(plugin),
            (std::vector<std::string>{"output 'pose': .figures() is for an output of figures, which are Metrics"}));
  plugin.node("test.early", figures).summary("s").figures({"a"}).out("metrics", "h");
  EXPECT_EQ(faults(plugin), (std::vector<std::string>{".figures() belongs after an .out()"}));
}

}  // namespace executor_test
