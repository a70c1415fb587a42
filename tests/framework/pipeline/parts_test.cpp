// SPDX-License-Identifier: Apache-2.0
// Pipelines as nodes of others.
#include "tests/framework/pipeline/pipeline_fixture.hpp"

namespace parts_test {

using marrow::Pipeline;

const std::string kPart =
    "marrow: 1\nhelp: adds a constant\ninputs:\n  to: {type: metrics, help: what it is added to}\n"
    "  by: {type: number, default: 3}\nnodes:\n  c: {uses: test.constant, with: {value: $by}}\n"
    "  sum: {uses: test.add, in: {a: to, b: c}}\noutputs: {sum: sum}\n";

class PartsTest : public pipeline_fixture::LayersTest {
 protected:
  void SetUp() override { scratch.write("part.yaml", kPart); }
  /// A pipeline of these nodes in line 3 and after it.
  marrow::Pipeline whole(const std::string& nodes, const std::string& outputs = "o: plus",
                         const marrow::PipelineArguments& arguments = {}) {
    return read("marrow: 1\nnodes:\n" + nodes + "outputs: {" + outputs + "}\n", arguments);
  }
  static inline const std::string kUse = "  d: {uses: test.draw}\n  plus: {uses: part.yaml, in: {to: d}}\n";
};

TEST_F(PartsTest, ItsNodesTakeItsPlaceAsOneWouldHaveWrittenThem) {
  const Pipeline p = good(whole(kUse));
  EXPECT_EQ(ids(p), "d plus/c plus/sum");
  EXPECT_EQ(wires(p, "plus/sum"), "a <- d, b <- plus/c");
  EXPECT_EQ(p.outputs[0].source.text, "plus/sum");
  EXPECT_EQ(number(p, "plus/c"), 3);
  EXPECT_EQ(p.files.size(), 2u);
  EXPECT_TRUE(p.notes.empty());
  const std::string yaml = marrow::resolved_yaml(good(whole(kUse)));
  EXPECT_EQ(marrow::resolved_yaml(good(read(yaml))), yaml);
}

TEST_F(PartsTest, InputsAreOptionsAndPorts) {
  const Pipeline p =
      good(read("marrow: 1\ninputs: {n: {type: number, default: 2}}\nnodes:\n  d: {uses: test.draw}\n"
                "  plus: {uses: part.yaml, in: {to: d}, with: {by: $n}}\n"
                "  again: {uses: part.yaml, in: {to: plus}, with: {by: 5}}\noutputs: {o: again}\n"));
  EXPECT_EQ(number(p, "plus/c"), 2);
  EXPECT_EQ(number(p, "again/c"), 5);
  EXPECT_EQ(wires(p, "again/sum"), "a <- plus/sum, b <- again/c");
  EXPECT_TRUE(p.notes.empty()) << p.notes[0];
}

TEST_F(PartsTest, ItIsCalledForEachItem) {
  const Pipeline p = good(whole("  l: {uses: test.letters}\n  plus: {uses: part.yaml, in: {to: l}}\n"));
  EXPECT_EQ(node(p, "plus/sum").mapped_axes, std::vector<std::string>{"letter"});
  EXPECT_EQ(p.axes_of(p.outputs[0].source), std::vector<std::string>{"letter"});
  const Pipeline one = good(whole("  l: {uses: test.letters}\n  plus: {uses: part.yaml, in: {to: l.b}}\n"));
  EXPECT_TRUE(node(one, "plus/sum").mapped_axes.empty());
}

TEST_F(PartsTest, ListsOfReferencesGoIn) {
  scratch.write("list.yaml",
                "marrow: 1\ninputs: {all: {type: metrics, over: item}, more: {type: metrics, optional: true}}\nnodes:\n"
                "  c: {uses: test.constant}\n  s: {uses: test.sum, in: {items: all}}\n"
                "  t: {uses: test.sum, in: {items: [c, more]}}\noutputs: {s: s, t: t}\n");
  const Pipeline p =
      good(whole("  a: {uses: test.draw}\n  b: {uses: test.draw}\n"
                 "  plus: {uses: list.yaml, in: {all: [a, b]}}\n"
                 "  with: {uses: list.yaml, in: {all: [a, b], more: b}}\n",
                 "o: plus.s, p: plus.t, q: with.t"));
  EXPECT_EQ(wires(p, "plus/s"), "items <- a b");
  EXPECT_EQ(wires(p, "plus/t"), "items <- plus/c") << "an optional input that is left out";
  EXPECT_EQ(wires(p, "with/t"), "items <- with/c b");
}

TEST_F(PartsTest, FunctionsGoInAndOut) {
  scratch.write("maker.yaml",
                "marrow: 1\nonly_inside: true\ninputs: {amount: {type: metrics}}\n"
                "nodes: {f: {uses: test.adder, in: {amount: amount}}}\noutputs: {f: f}\n");
  scratch.write("user.yaml",
                "marrow: 1\ninputs: {f: {type: adder}, to: {type: metrics}}\n"
                "nodes: {n: {uses: test.apply, in: {adder: f, to: to}}}\noutputs: {n: n}\n");
  const Pipeline p =
      good(whole("  d: {uses: test.draw}\n  make: {uses: maker.yaml, in: {amount: d}}\n"
                 "  plus: {uses: user.yaml, in: {f: make.f, to: d}}\n"));
  EXPECT_EQ(wires(p, "plus/n"), "adder <- make/f, to <- d");
}

TEST_F(PartsTest, APartMayHaveParts) {
  scratch.write("twice.yaml",
                "marrow: 1\ninputs: {x: {type: metrics}}\nnodes:\n"
                "  one: {uses: part.yaml, in: {to: x}}\n  two: {uses: part.yaml, in: {to: one.sum}}\n"
                "outputs: {y: two.sum, x: x}\n");
  const Pipeline p =
      good(whole("  d: {uses: test.draw}\n  plus: {uses: twice.yaml, in: {x: d}}\n"
                 "  n: {uses: test.add, in: {a: plus.y, b: plus.x}}\n",
                 "o: n"));
  EXPECT_EQ(wires(p, "plus/two/sum"), "a <- plus/one/sum, b <- plus/two/c");
  EXPECT_EQ(wires(p, "n"), "a <- plus/two/sum, b <- d") << "what goes through is what was given";
}

TEST_F(PartsTest, ChangesReachIn) {
  const std::string set = "  d: {uses: test.draw}\n  plus: {uses: part.yaml, in: {to: d}, set: {c.value: 7}}\n";
  EXPECT_EQ(number(good(whole(set)), "plus/c"), 7);
  EXPECT_EQ(number(good(whole(set, "o: plus", {{}, {{"plus.c.value", "8"}}})), "plus/c"), 8);
  EXPECT_EQ(number(good(whole(set, "o: plus", {{}, {{"plus/c.value", "9"}}})), "plus/c"), 9) << "as runs call it";
  EXPECT_EQ(number(good(whole(kUse, "o: plus", {{}, {{"plus.by", "2"}}})), "plus/c"), 2);
  const Pipeline added = good(whole(kUse, "o: plus", {{}, {{"plus.sum.in.a", "e"}, {"plus.e.uses", "test.constant"}}}));
  EXPECT_EQ(wires(added, "plus/sum"), "a <- plus/e, b <- plus/c");
  const Pipeline other = good(whole(set, "o: plus", {{}, {{"plus.c.uses", "test.draw"}}}));
  EXPECT_EQ(node(other, "plus/c").info.name, "test.draw");
  whole(kUse, "o: plus", {{}, {{"plus.x.value", "8"}}});
  EXPECT_EQ(only_fault().message, "the pipeline has no node 'x'");
}

TEST_F(PartsTest, APartIsSwappedForAnotherOrExtended) {
  scratch.write("other.yaml",
                "marrow: 1\ninputs: {to: {type: metrics}}\nnodes:\n  c: {uses: test.draw}\n"
                "  sum: {uses: test.add, in: {a: to, b: c}}\noutputs: {sum: sum}\n");
  scratch.write("base.yaml",
                "marrow: 1\nnodes:\n  d: {uses: test.draw}\n"
                "  plus: {uses: part.yaml, in: {to: d}, with: {by: 4}, set: {c.word: two}}\noutputs: {o: plus}\n");
  const Pipeline p = good(read("marrow: 1\nextends: base.yaml\nset: {plus.uses: other.yaml}\n"));
  EXPECT_EQ(node(p, "plus/c").info.name, "test.draw");
  scratch.write("more.yaml", "marrow: 1\nextends: part.yaml\nset: {c.value: 6}\n");
  EXPECT_EQ(number(good(whole("  d: {uses: test.draw}\n  plus: {uses: more.yaml, in: {to: d}}\n")), "plus/c"), 6);
}

TEST_F(PartsTest, ABodyMayHaveParts) {
  scratch.write("body.yaml",
                "marrow: 1\ninputs: {x: {type: metrics}}\nnodes:\n"
                "  plus: {uses: part.yaml, in: {to: x}}\noutputs: {y: plus}\n");
  const std::string letters = "  l: {uses: test.letters}\n";
  const Pipeline p = good(whole(letters + "  loop: {over: letter, repeat: body.yaml, in: {x: l}}\n", "o: loop.y"));
  EXPECT_EQ(ids(node(p, "loop").repetition->alone), "x plus/c plus/sum");
  const Pipeline set = good(whole(letters + "  loop: {over: letter, repeat: body.yaml, in: {x: l}}\n", "o: loop.y",
                                  {{}, {{"loop.body.plus.c.value", "4"}}}));
  EXPECT_EQ(number(node(set, "loop").repetition->alone, "plus/c"), 4);
  whole(letters + "  loop: {at_most: 1, repeat: body.yaml}\n", "o: loop.y");
  expect_fault_in("p.yaml", 4, "node 'loop': node 'x' of the body needs an input of the body that has no value");
}

TEST_F(PartsTest, CheckedAloneItsInputsStandThere) {
  marrow::Diagnostics faults;
  const Pipeline p = marrow::read_pipeline(scratch.path / "part.yaml", {}, catalogue(), faults, false);
  EXPECT_TRUE(faults.empty()) << faults.text();
  EXPECT_EQ(ids(p), "to c sum");
  const std::string yaml = marrow::resolved_yaml(p);
  EXPECT_HAS(yaml, "inputs:\n  to: {type: metrics}\n");
  const marrow::PipelineArguments none;
  diagnostics = {};
  marrow::read_pipeline(scratch.path / "part.yaml", none, catalogue(), diagnostics);
  expect_fault_in("part.yaml", 4, "input 'to' is data of type metrics, which only another pipeline can give",
                  "use this file as a node of it:  uses: part.yaml");
}

TEST_F(PartsTest, FaultsOfItsUser) {
  whole("  plus: {uses: prt.yaml}\n");
  expect_fault_in("p.yaml", 3, "there is no file 'prt.yaml' to use as a node", "did you mean 'part.yaml'?");
  whole("  plus: {uses: part.yaml}\n");
  expect_fault_in("p.yaml", 3, "node 'plus': input 'to' of part.yaml is not wired",
                  "add  in: {to: ...}  with metrics (what it is added to)");
  whole("  d: {uses: test.draw}\n  plus: {uses: part.yaml, in: {to: d, too: d}}\n");
  expect_fault_in("p.yaml", 4, "'part.yaml' has no input 'too' of data", "did you mean 'to'?");
  whole("  d: {uses: test.draw}\n  plus: {uses: part.yaml, in: {to: d}, with: {buy: 3}}\n");
  expect_fault_in("p.yaml", 4, "the pipeline has no input 'buy'", "did you mean 'by'?");
  whole("  d: {uses: test.draw}\n  plus: {uses: part.yaml, in: {to: d}, with: {by: [3]}}\n");
  expect_fault_in("p.yaml", 4, "input 'by' of part.yaml must be one value");
  whole("  d: {uses: test.draw}\n  plus: {uses: part.yaml, in: {to: d}, with: {by: much}}\n");
  expect_fault_in("p.yaml", 4, "input 'by': expected a number, got 'much'");
  whole("  d: {uses: test.draw}\n  plus: {uses: part.yaml, in: {to: d}, with: {to: 3}}\n");
  expect_fault_in("p.yaml", 4, "input 'to' is data of type metrics, which only a node can give", "give it under  in:");
  whole("  d: {uses: test.draw}\n  plus: {uses: part.yaml, in: {to: d}, may_fail: true}\n");
  expect_fault_in("p.yaml", 4, "node 'plus' is a pipeline, and 'may_fail' is for single nodes",
                  "set: {NODE.may_fail: true}");
  whole(kUse, "o: plus.sun.x");
  EXPECT_EQ(diagnostics.size(), 1u) << diagnostics.text();
}

TEST_F(PartsTest, TheOutputIsNamedUnlessThereIsOne) {
  scratch.write("two.yaml", "marrow: 1\nnodes: {c: {uses: test.draw}, d: {uses: test.draw}}\noutputs: {c: c, d: d}\n");
  whole("  plus: {uses: two.yaml}\n");
  expect_fault_in("p.yaml", 4, "node 'plus' has several outputs", "say which: plus.c, d");
  whole("  plus: {uses: two.yaml}\n", "o: plus.e");
  expect_fault_in("p.yaml", 4, "node 'plus' has no output 'e'");
}

TEST_F(PartsTest, FaultsAreShownWhereTheyAre) {
  scratch.write("wrong.yaml",
                "marrow: 1\ninputs: {to: {type: metrics}}\nnodes:\n  c: {uses: test.constnt}\n"
                "outputs: {c: c}\n");
  whole("  d: {uses: test.draw}\n  plus: {uses: wrong.yaml, in: {to: d}}\n");
  expect_fault_in("wrong.yaml", 4, "unknown node 'test.constnt'");
  whole("  f: {uses: test.adder, in: {amount: d}}\n  d: {uses: test.draw}\n  plus: {uses: part.yaml, in: {to: f}}\n");
  expect_fault_in("p.yaml", 5, "input 'a' of test.add expects metrics, but 'f' is adder");
  whole("  plus: {uses: part.yaml, in: {to: e}}\n");
  expect_fault_in("p.yaml", 3, "there is no node 'e'");
  whole("  a: {uses: part.yaml, in: {to: b}}\n  b: {uses: part.yaml, in: {to: a}}\n", "o: a");
  EXPECT_HAS(only_fault().message, "these nodes wait for each other in a circle: a/sum, b/sum");
}

TEST_F(PartsTest, ItsTypesAndAPartOfItself) {
  scratch.write("types.yaml",
                "marrow: 1\ninputs:\n  a: {type: metrix}\n  b: {type: number, over: item}\n"
                "  c: {type: metrics, default: 3}\n  d: {optional: true}\nnodes:\n"
                "  e: {uses: test.draw}\noutputs: {e: e}\n");
  marrow::read_pipeline(scratch.path / "types.yaml", {}, catalogue(), diagnostics, false);
  const std::string text = diagnostics.text();
  for (const char* wanted :
       {"unknown type 'metrix' of input 'a'", "did you mean 'metrics'?",
        "'over' is for inputs of data, and input 'b' is a number", "input 'c' is of type metrics, which has no default",
        "'optional' is for inputs of data, and input 'd' is a text", "give it a  default:  instead"})
    EXPECT_HAS(text, wanted) << wanted << "\n" << text;
  scratch.write("self.yaml", "marrow: 1\nnodes:\n  s: {uses: self.yaml}\noutputs: {s: s}\n");
  whole("  plus: {uses: self.yaml}\n");
  expect_fault_in("self.yaml", 3, "'self.yaml' uses itself: a pipeline must not be its own part");
}

TEST_F(PartsTest, ManyPartsAndNamesWithASlash) {
  scratch.write("n0.yaml", "marrow: 1\nnodes: {d: {uses: test.draw}}\noutputs: {d: d}\n");
  for (int i = 0; i < 7; ++i) {
    std::string nodes;
    for (int k = 0; k < 10; ++k) nodes += "  p" + std::to_string(k) + ": {uses: n" + std::to_string(i) + ".yaml}\n";
    scratch.write("n" + std::to_string(i + 1) + ".yaml", "marrow: 1\nnodes:\n" + nodes + "outputs: {d: p0}\n");
  }
  whole("  plus: {uses: n6.yaml}\n");
  EXPECT_HAS(diagnostics.text(), "the parts of the pipeline have 20000 nodes or more");
  whole("  plus: {uses: n7.yaml}\n");
  EXPECT_HAS(diagnostics.text(), "parts lie more than 8 deep in each other");
  good(whole("  a/b: {uses: test.draw}\n", "o: a/b"));
  whole("  a/b: {uses: test.draw}\n  a: {uses: test.draw}\n", "o: a/b");
  expect_fault_in("p.yaml", 3, "the node's name 'a/b' has a slash", "slashes are for nodes of a body or of a part");
}

}  // namespace parts_test
