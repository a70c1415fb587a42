// SPDX-License-Identifier: Apache-2.0
// Every diagnostic of a pipeline file, at its place.
#include <ctime>

#include "tests/framework/pipeline/pipeline_fixture.hpp"

namespace pipeline_faults_test {

using pipeline_fixture::PipelineTest;
using runtime_fixture::test_catalogue;

TEST_F(PipelineTest, RenamedNodeIsPointedAtWhereItIsDefined) {
  read(
      "marrow: 1\nnodes:\n  lefft: {uses: test.constant}\n  n: {uses: test.add, in: {a: left, b: left}}\noutputs: {o: "
      "n}\n");
  const std::vector<marrow::Diagnostic> faults = diagnostics.sorted();
  ASSERT_EQ(faults.size(), 3u) << diagnostics.text();
  EXPECT_EQ(faults[0].place.line, 3);
  EXPECT_EQ(faults[0].message, "nothing uses node 'lefft'");
  EXPECT_EQ(faults[0].hint, "'left' is used but not defined; did you mean this name?");
  EXPECT_EQ(faults[1].message, "there is no node 'left'");
}
TEST_F(PipelineTest, RenamedInputIsPointedAtWhereItIsDeclared) {
  read(
      "marrow: 1\ninputs:\n  casse: {type: number, default: 1}\nnodes:\n  n: {uses: test.constant, with: {value: "
      "$case}}\noutputs: {o: n}\n");
  const std::vector<marrow::Diagnostic> faults = diagnostics.sorted();
  ASSERT_EQ(faults.size(), 2u) << diagnostics.text();
  EXPECT_EQ(faults[0].place.line, 3);
  EXPECT_EQ(faults[0].message, "nothing uses input 'casse'");
  EXPECT_EQ(faults[1].message, "the pipeline has no input 'case'");
}

TEST_F(PipelineTest, SyntaxErrorTellsWhatIsNotClosed) {
  const auto places = [&](const std::string& text) {
    read(text);
    std::string result;
    for (const marrow::Diagnostic& fault : diagnostics.sorted())
      result +=
          std::to_string(fault.place.line) + ":" + std::to_string(fault.place.column) + " " + fault.message + "\n";
    return result;
  };
  EXPECT_EQ(places("marrow: 1\nnodes: {a: [\n"),
            "2:12 this [ is not closed\n3:1 not valid YAML: end of sequence flow not found\n");
  EXPECT_HAS(places("marrow: 1\nnodes:\n  c: {uses: 'test.constant}\n  # all\n\n"), "3:13 this ' is not closed\n");
  EXPECT_HAS(places("marrow: 1\nnodes:\n  c: {uses: [test.constant}\n  d: {}\n"), "3:13 this [ is not closed\n");
  EXPECT_EQ(places("marrow: 1\n\tnodes: {}\n").find("closed"), std::string::npos);
}

TEST_F(PipelineTest, SyntaxErrorSaysWhatToQuote) {
  const auto hint = [&](const std::string& help) {
    read("marrow: 1\nhelp: " + help + "\nnodes: {}\n");
    return diagnostics.sorted()[0].hint;
  };
  EXPECT_EQ(hint("edges: Canny's"),
            "write a text that has a colon and a blank in it in quotes, as  help: \"edges: Canny's\"");
  for (const char* help : {"@home", "`edges`", "%5"})
    EXPECT_EQ(hint(help), "write a text that begins with @, ` or % in quotes");
}

TEST_F(PipelineTest, UnreadableFile) {
  marrow::read_pipeline(scratch.path / "none.yaml", {}, test_catalogue(), diagnostics);
  EXPECT_HAS(diagnostics.text(), "the pipeline file cannot be read");
}

/// A file with one fault, at its place.
struct FileFault {
  std::string name, text;
  int line, column;
  std::string message, hint = {};
};
class FaultOfFile : public PipelineTest, public testing::WithParamInterface<FileFault> {};
const std::string kOne = "{c: {uses: test.constant}}\noutputs: {o: c}\n";
const std::string kNodesBelow = "marrow: 1\nnodes:\n";
INSTANTIATE_TEST_SUITE_P(
    , FaultOfFile,
    testing::ValuesIn(std::vector<FileFault>{
        {"NoMap", "- a\n", 1, 1, "the pipeline must be a map, got a list"},
        {"MissingVersion", "nodes: " + kOne, 1, 1, "the key 'marrow' is missing"},
        {"OtherVersion", "marrow: 2\nnodes: " + kOne, 1, 1, "this file is of format 2, this program reads format 1"},
        {"MissingOutputs", "marrow: 1\nnodes: {c: {uses: test.constant}}\n", 1, 1, "the key 'outputs' is missing"},
        {"NoNodes", "marrow: 1\nnodes: {}\noutputs: {}\n", 1, 1, "the pipeline has no nodes",
         "name them under  nodes:"},
        {"UnknownKey", "marrow: 1\nnode: {}\nnodes: " + kOne, 2, 1, "unknown key 'node'", "did you mean 'nodes'?"},
        {"DuplicateKey", kNodesBelow + "  c: {uses: test.constant}\n  c: {uses: test.sides}\noutputs: {o: c}\n", 4, 3,
         "'c' is given twice", "line 3"},
        {"MergeKey", kNodesBelow + "  c: {uses: test.constant, <<: {with: {}}}\noutputs: {o: c}\n", 3, 28,
         "merge keys (<<) are not supported"},
        {"NodeWithoutName", kNodesBelow + "  \"\": {uses: test.constant}\noutputs: {o: \"\"}\n", 3, 3,
         "a node has no name", "write it as  name: {uses: kind.name}"},
        {"DotInName", kNodesBelow + "  a.b: {uses: test.constant}\n  c: {uses: test.constant}\noutputs: {o: c}\n", 3, 3,
         "has a dot"},
        {"WrongType",
         kNodesBelow + "  t: {uses: test.truth}\n  a: {uses: test.apply, in: {adder: c, to: c}}\n"
                       "  c: {uses: test.constant}\noutputs: {o: c}\n",
         4, 30, "input 'adder' of test.apply expects adder, but 'c' is metrics"},
        {"Circle",
         kNodesBelow + "  a: {uses: test.add, in: {a: b}}\n  b: {uses: test.add, in: {a: a}}\noutputs: {o: a}\n", 3, 3,
         "these nodes wait for each other in a circle: a, b"},
        {"MissingInputValue",
         "marrow: 1\ninputs:\n  v: {type: number}\nnodes: {c: {uses: test.constant, with: {value: $v}}}\n"
         "outputs: {o: c}\n",
         3, 3, "input 'v' has no value", "v=VALUE"},
        {"UnknownInputType", "marrow: 1\ninputs:\n  v: {type: nummber, default: 1}\nnodes: " + kOne, 3, 7,
         "unknown type 'nummber'", "did you mean 'number'?"},
    }),
    [](const auto& test) { return test.param.name; });
TEST_P(FaultOfFile, IsAtItsPlace) {
  const FileFault& fault = GetParam();
  expect_fault(fault.text, fault.line, fault.column, fault.message, fault.hint);
}
TEST_F(PipelineTest, UnknownGivenInput) {
  expect_fault("marrow: 1\ninputs: {value: {type: number, default: 1}}\nnodes: " + kOne, 0, 0,
               "the pipeline has no input 'valu'", "did you mean 'value'?", {{{"valu", "2"}}, {}});
}

/// A node with one fault, in the file of expect_node_fault().
struct NodeFault {
  std::string name, node;
  int column;
  std::string message, hint = {};
};
/// A fault at an option, which begins in column 35.
NodeFault option_fault(const std::string& name, const std::string& option, const std::string& message,
                       const std::string& hint = {}) {
  return {name, "{uses: test.constant, with: {" + option + "}}", 35, message, hint};
}
class FaultOfNode : public PipelineTest, public testing::WithParamInterface<NodeFault> {};
INSTANTIATE_TEST_SUITE_P(
    , FaultOfNode,
    testing::ValuesIn(std::vector<NodeFault>{
        {"UnknownNode", "{uses: test.constnat}", 13, "unknown node 'test.constnat'", "did you mean 'test.constant'?"},
        {"MissingUses", "{with: {value: 1}}", 3, "node 'n' does not say what it uses"},
        option_fault("UnknownOption", "vlaue: 1", "has no option 'vlaue'", "did you mean 'value'?"),
        option_fault("NumberExpected", "value: big", "expected a number, got 'big'"),
        option_fault("QuotedNumberIsText", "value: \"1\"", "expected a number, got the quoted text \"1\""),
        option_fault("NotANumber", "value: nan", "expected a number, got 'nan'"),
        option_fault("BelowRange", "value: -2000", "-2000 is below the least allowed, -1000"),
        option_fault("AboveRange", "value: 2000", "2000 is above the most allowed, 1000"),
        option_fault("WholeNumberThatTheOptionCannotHold", "count: 5000000000",
                     "5000000000 is above the most allowed, 2147483647"),
        option_fault("OctalLookingInteger", "count: 010", "expected an integer, got '010'",
                     "write it without leading zeros"),
        option_fault("FractionForInteger", "count: 1.5", "expected an integer, got '1.5'"),
        option_fault("YesIsNotTrue", "flag: yes", "expected true or false, got 'yes'"),
        option_fault("UnknownChoice", "word: tow", "'tow' is not one of its choices", "did you mean 'two'?"),
        option_fault("ListExpected", "numbers: 3", "expected a list, got '3'", "[a, b, c]"),
        option_fault("WrongLength", "point: [1, 2]", "expected 3 numbers, got 2"),
        {"UnknownInputName", "{uses: test.constant, with: {value: $v}}", 42, "the pipeline has no input 'v'"},
        {"UnknownPort", "{uses: test.add, in: {a: c, bb: c}}", 34, "has no input 'bb'", "did you mean 'b'?"},
        {"UnwiredPort", "{uses: test.add, in: {b: c}}", 3, "input 'a' of test.add is not wired"},
        {"UnknownSource", "{uses: test.add, in: {a: d}}", 28, "there is no node 'd'", "did you mean 'c'?"},
        {"UnknownOutput", "{uses: test.add, in: {a: s.lefft}}", 28, "node 's' has no output 'lefft'",
         "did you mean 'left'?"},
        {"AmbiguousOutput", "{uses: test.add, in: {a: s}}", 28,
         "node 's' has several outputs, and not exactly one of them is metrics"},
        {"ListForSingle", "{uses: test.add, in: {a: [c, c]}}", 28, "takes one metrics, not a list"},
        {"TooManyPicks", "{uses: test.add, in: {a: s.left.x}}", 28, "'s.left.x' picks 'x', but it is not a list"},
    }),
    [](const auto& test) { return test.param.name; });
TEST_P(FaultOfNode, IsAtItsPlace) {
  const NodeFault& fault = GetParam();
  expect_node_fault(fault.node, fault.column, fault.message, fault.hint);
}

TEST_F(PipelineTest, OutputOfAnotherNodeOfTheKindIsNoItem) {
  const std::string before = kNodesBelow + "  l: {uses: test.letters}\n  n: {uses: test.add, in: {a: ";
  expect_fault(before + "l.left}}\noutputs: {o: n}\n", 4, 28, "node 'l' has no output 'left'",
               "other nodes of the kind test have one; an item of that name is l.letters.left");
  for (const char* item : {"l.letters.left", "l.far_left"}) {
    read_good(before + item + "}}\noutputs: {o: n}\n");
  }
}
TEST_F(PipelineTest, TruthOnlyForEvaluation) {
  expect_fault(kNodesBelow + "  t: {uses: test.truth}\n  a: {uses: test.add, in: {a: t}}\noutputs: {o: a}\n", 4, 28,
               "the truth may be wired only to nodes of a kind that may see it, not to test.add");
  read_good(kNodesBelow +
            "  t: {uses: test.truth}\n  c: {uses: test.constant}\n  a: {uses: judge.test, in: {of: c, truth: t}}\n"
            "outputs: {o: a}\n");
}

TEST_F(PipelineTest, TenMistakesGiveTenDiagnostics) {
  read(
      "marrow: 1\n"
      "colour: red\n"  // 2 unknown key
      "inputs:\n"
      "  v: {type: nubmer, default: 1}\n"  // 4 unknown type
      "nodes:\n"
      "  c: {uses: test.constant, with: {value: abc}}\n"  // 6 no number
      "  d: {uses: test.constant, with: {word: four}}\n"  // 7 no choice
      "  e: {uses: test.nothing_known}\n"                 // 8 unknown node
      "  f: {uses: test.add, in: {a: c, z: c}}\n"         // 9 unknown port
      "  g: {uses: test.add, in: {b: c}}\n"               // 10 unwired
      "  h: {uses: test.apply, in: {adder: c, to: c}}\n"  // 11 type
      "  h: {uses: test.constant}\n"                      // 12 twice
      "outputs: {o: missing}\n");                         // 13 no such node
  std::vector<int> lines;
  for (const marrow::Diagnostic& fault : diagnostics.sorted()) lines.push_back(fault.place.line);
  EXPECT_EQ(lines, (std::vector<int>{2, 4, 6, 7, 8, 9, 10, 11, 12, 13})) << diagnostics.text();
}

TEST_F(PipelineTest, SourceLineIsShown) {
  read("marrow: 1\nnodes:\n  c: {uses: test.constnat}\noutputs: {o: c}\n");
  EXPECT_HAS(diagnostics.text(),
             "p.yaml:3:13: error: unknown node 'test.constnat'\n    c: {uses: test.constnat}\n              ^\n");
}

// Wires that their node does not use, and circles of used and unused wires. The pipelines are so short that a reader
// can follow the wires and see which nodes are in a circle.

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

TEST_F(Circles, UnusedWiresAreNotedAndUsedOnesNot) {
  const marrow::Pipeline p = read_good(
      "marrow: 1\nnodes:\n  c: {uses: test.constant}\n  n: {uses: test.constant, in: {a: c}}\noutputs: {o: n}\n");
  EXPECT_EQ(p.notes, std::vector<std::string>{"node 'n': the wire to 'a' is not used: test.constant does not have "
                                              "this input, only other nodes of the kind test do"});
  EXPECT_TRUE(p.nodes[1].wires.empty());
  const marrow::Pipeline used =
      read("marrow: 1\nnodes:\n  c: {uses: test.constant}\n  n: {uses: test.add, in: {a: c}}\noutputs: {o: n}\n");
  EXPECT_TRUE(used.notes.empty());
}

TEST_F(Circles, AnInputThatNothingUsesIsNoted) {
  const marrow::Pipeline p = read_good(
      "marrow: 1\ninputs: {v: {type: number, default: 1}, w: {type: number, default: 1}}\n"
      "nodes: {c: {uses: test.constant, with: {value: $w}}}\noutputs: {o: c}\n");
  EXPECT_EQ(p.notes, std::vector<std::string>{"nothing uses the input 'v'"});
}

TEST_F(Circles, AnUnusedWireClosesACircleOfItsOwnNodes) {
  expect_fault(
      "marrow: 1\nnodes:\n  n: {uses: test.constant, in: {a: m}}\n  m: {uses: test.add, in: {a: n}}\noutputs: {o: "
      "m}\n",
      3, 3, "these nodes wait for each other in a circle: n, m",
      "n takes m as 'a', m takes n as 'a'; leave out one of these wires");
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

}  // namespace pipeline_faults_test
