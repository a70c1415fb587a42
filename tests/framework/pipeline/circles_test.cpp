// SPDX-License-Identifier: Apache-2.0
// Wires that their node does not use, and circles of used and unused wires. The pipelines are so short that a reader
// can follow the wires and see which nodes are in a circle.
#include <ctime>

#include "tests/framework/pipeline/pipeline_fixture.hpp"

namespace circles_test {

class Circles : public pipeline_fixture::PipelineTest {
 protected:
  /// All faults, one a line.
  std::string faults(const std::string& nodes, const marrow::PipelineArguments& arguments = {}) {
    read("marrow: 1\nnodes:\n" + nodes, arguments);
    std::string text;
    for (const marrow::Diagnostic& fault : diagnostics.sorted())
      text += std::to_string(fault.place.line) + ": " + fault.message + "\n";
    return text;
  }
};

TEST_F(Circles, AWireToAPortOfAnotherNodeOfTheKindIsNotedAsUnused) {
  const marrow::Pipeline p = read_good(
      "marrow: 1\nnodes:\n  c: {uses: test.constant}\n  n: {uses: test.constant, in: {a: c}}\noutputs: {o: n}\n");
  EXPECT_EQ(p.notes, std::vector<std::string>{"node 'n': the wire to 'a' is not used: test.constant does not have "
                                              "this input, only other nodes of the kind test do"});
  EXPECT_TRUE(p.nodes[1].wires.empty());
}

TEST_F(Circles, AUsedWireIsNotNoted) {
  const marrow::Pipeline p =
      read("marrow: 1\nnodes:\n  c: {uses: test.constant}\n  n: {uses: test.add, in: {a: c}}\noutputs: {o: n}\n");
  EXPECT_TRUE(p.notes.empty());
}

TEST_F(Circles, AnInputThatNothingUsesIsNoted) {
  const marrow::Pipeline p = read_good(
      "marrow: 1\ninputs: {v: {type: number, default: 1}, w: {type: number, default: 1}}\n"
      "nodes: {c: {uses: test.constant, with: {value: $w}}}\noutputs: {o: c}\n");
  EXPECT_EQ(p.notes, std::vector<std::string>{"nothing uses the input 'v'"});
}

TEST_F(Circles, AnUnusedWireClosesACircle) {
  expect_fault(
      "marrow: 1\nnodes:\n  n: {uses: test.constant, in: {a: m}}\n  m: {uses: test.add, in: {a: n}}\noutputs: {o: "
      "m}\n",
      3, 3, "these nodes wait for each other in a circle: n, m",
      "n takes m as 'a', m takes n as 'a'; leave out one of these wires");
}

TEST_F(Circles, OnlyItsOwnNodesAreNamed) {
  EXPECT_EQ(faults("  user: {uses: test.add, in: {a: b}}\n"
                   "  a: {uses: test.add, in: {a: b, b: source}}\n"
                   "  source: {uses: test.constant}\n"
                   "  b: {uses: test.add, in: {a: a}}\n"
                   "  after: {uses: test.sum, in: {items: [user, a]}}\n"
                   "outputs: {o: after}\n"),
            "4: these nodes wait for each other in a circle: a, b\n");
}

TEST_F(Circles, EachIsNamedAlone) {
  // 'between' waits for the first circle, and the second circle waits for 'between'. It is in neither.
  EXPECT_EQ(faults("  a: {uses: test.add, in: {a: b}}\n"
                   "  b: {uses: test.add, in: {a: a}}\n"
                   "  between: {uses: test.add, in: {a: a}}\n"
                   "  c: {uses: test.add, in: {a: d, b: between}}\n"
                   "  d: {uses: test.add, in: {a: e}}\n"
                   "  e: {uses: test.add, in: {a: c}}\n"
                   "  self: {uses: test.sum, in: {items: [a, self]}}\n"
                   "outputs: {o: e}\n"),
            "3: these nodes wait for each other in a circle: a, b\n"
            "6: these nodes wait for each other in a circle: c, d, e\n"
            "9: node 'self' waits for itself\n");
}

TEST_F(Circles, ItIsShownBesideOtherFaults) {
  EXPECT_EQ(faults("  a: {uses: test.add, in: {a: b}}\n"
                   "  b: {uses: test.nothing_known, in: {x: a.left}}\n"
                   "  c: {uses: test.constant, with: {value: many}}\n"
                   "outputs: {o: a}\n"),
            "3: these nodes wait for each other in a circle: a, b\n"
            "4: unknown node 'test.nothing_known'\n"
            "5: option 'value' of test.constant: expected a number, got 'many'\n");
}

TEST_F(Circles, AnOverrideClosesOneAndABodyHoldsOne) {
  const std::string nodes = "  a: {uses: test.constant}\n  b: {uses: test.add, in: {a: a}}\noutputs: {o: b}\n";
  EXPECT_EQ(faults(nodes), "");
  EXPECT_EQ(faults(nodes, {{}, {{"a.in.after", "b"}}}), "3: these nodes wait for each other in a circle: a, b\n");
  EXPECT_EQ(faults("  r:\n    at_most: 1\n    repeat:\n      nodes:\n"
                   "        a: {uses: test.constant, in: {a: b}}\n"
                   "        b: {uses: test.add, in: {a: a}}\n"
                   "      outputs: {o: b}\n"
                   "outputs: {o: r.o}\n"),
            "7: these nodes wait for each other in a circle: a, b\n");
}

TEST_F(Circles, ThousandsTakeNoTime) {
  std::string nodes;
  for (int i = 0; i < 20000; ++i)
    nodes += "  n" + std::to_string(i) + ": {uses: test.add, in: {a: n" + std::to_string(i ^ 1) + ", b: n" +
             std::to_string(i == 0 ? 1 : i - 1) + "}}\n";
  const std::clock_t start = std::clock();
  read("marrow: 1\nnodes:\n" + nodes + "outputs: {o: n1}\n");
  EXPECT_LT(double(std::clock() - start) / CLOCKS_PER_SEC, 20);
  EXPECT_GT(diagnostics.size(), 0u);
}

}  // namespace circles_test
