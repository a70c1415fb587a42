// SPDX-License-Identifier: Apache-2.0
// Every diagnostic of a pipeline file, at its place.
#include <ctime>

#include "framework/runtime/file_names.hpp"
#include "runtime/fixture.hpp"

namespace {

using marrow::Diagnostics;
using marrow::Pipeline;
using marrow::PipelineArguments;

class PipelineTest : public testing::Test {
 protected:
  Pipeline read(const std::string& text, const PipelineArguments& arguments = {}) {
    diagnostics = Diagnostics();
    return marrow::read_pipeline(scratch.write("p.yaml", text), arguments, test_catalogue(), diagnostics);
  }
  /// That there is one fault, at that place, whose message and hint hold the texts.
  void expect_fault(const std::string& text, int line, int column, const std::string& message,
                    const std::string& hint = "", const PipelineArguments& arguments = {}) {
    read(text, arguments);
    ASSERT_EQ(diagnostics.size(), 1u) << text << diagnostics.text();
    const marrow::Diagnostic fault = diagnostics.sorted()[0];
    EXPECT_EQ(fault.place.line, line) << diagnostics.text();
    EXPECT_EQ(fault.place.column, column) << diagnostics.text();
    EXPECT_NE(fault.message.find(message), std::string::npos) << diagnostics.text();
    EXPECT_NE(fault.hint.find(hint), std::string::npos) << diagnostics.text();
  }
  void expect_node_fault(const std::string& node, int column, const std::string& message,
                         const std::string& hint = "") {
    expect_fault(
        "marrow: 1\nnodes:\n  c: {uses: test.constant}\n  s: {uses: test.sides}\n  n: " + node + "\noutputs: {o: c}\n",
        5, column, message, hint);
  }
  Scratch scratch;
  Diagnostics diagnostics;
};

TEST_F(PipelineTest, GoodFileIsResolved) {
  const Pipeline p = read(
      "marrow: 1\ninputs: {v: {type: number, default: 3}}\nnodes:\n  add: {uses: test.add, in: {a: c, b: s.left}}\n"
      "  c: {uses: test.constant, with: {value: $v, word: two, point: [1, 2, 3]}}\n  s: {uses: test.sides}\noutputs: "
      "{o: add}\n");
  ASSERT_TRUE(diagnostics.empty()) << diagnostics.text();
  ASSERT_EQ(p.nodes.size(), 3u);
  EXPECT_EQ(p.nodes[2].id, "add") << "sources come before users";
  EXPECT_EQ(std::get<double>(p.nodes[0].options[0]), 3.0);
  EXPECT_EQ(std::get<std::string>(p.nodes[0].options[3]), "two");
}

TEST_F(PipelineTest, ResolvedYamlGivesTheSamePipeline) {
  const std::string text =
      "marrow: 1\nnodes:\n  c: {uses: test.constant, with: {value: 0.1, numbers: [1.5, 2]}}\n  s: {uses: test.sides}\n"
      "  n: {uses: test.sum, in: {items: [c, s.left]}}\noutputs: {o: n, p: s.both.a}\n";
  const std::string once = marrow::resolved_yaml(read(text));
  ASSERT_TRUE(diagnostics.empty()) << diagnostics.text();
  EXPECT_EQ(marrow::resolved_yaml(read(once)), once);
  EXPECT_TRUE(diagnostics.empty()) << diagnostics.text();
}

TEST_F(PipelineTest, ResolvedYamlKeepsEveryTextAndNumber) {
  const std::vector<std::string> texts{
      "3",   "0x10", "010",  "1e3",    "true", "no",   "~",      "null",         "",    " ",   " a ", "a: b",
      "a:b", "#a",   "a #b", "- a",    "[a",   "]",    "{a: b}", "a, b",         "'a'", "\"",  "\\",  "@a",
      "!a",  "&a",   "*a",   "%a",     "|",    ">",    "?",      "? a",          "-",   "---", "...", "<<",
      "$",   "$$",   "$a$b", "a\nb\n", "\ta",  "\x7f", "\x01",   "\u00e9\u6f22", "=",   ","};
  const Pipeline plain =
      read("marrow: 1\nnodes:\n  c: {uses: test.constant}\n  s: {uses: test.sides}\noutputs: {c: c, s: s.left}\n");
  for (const std::string& text : texts) {
    Pipeline p = plain;
    p.nodes[0].options[0] = 1.0 / 3;
    p.nodes[0].options[1] = std::int64_t(2147483647);
    p.nodes[0].options[4] = std::vector<double>{0.1, -0.0, 1e-300, 1.7976931348623157e308, 5e-324};
    p.nodes[0].options[6] = text.empty() ? text : "/folder " + text;
    p.nodes[1].options[0] = std::vector<std::string>{text, "b", text};
    const bool is_name = marrow::fault_of_name(text).empty();
    if (is_name) p.name = text;
    const Pipeline again = read(marrow::resolved_yaml(p));
    ASSERT_TRUE(diagnostics.empty()) << diagnostics.text();
    for (std::size_t i = 0; i < p.nodes.size(); ++i)
      EXPECT_EQ(again.nodes[i].options, p.nodes[i].options) << marrow::resolved_yaml(p);
    if (is_name) {
      EXPECT_EQ(again.name, text);
    }
  }
}

TEST_F(PipelineTest, TwoDollarsAreOneAndNoNameOfAnInput) {
  const Pipeline p = read(
      "marrow: 1\ninputs: {a: {type: text, default: x$a}}\nnodes:\n  s: {uses: test.sides, with: {names: [$$a, $a, "
      "$a$$, $$$a]}}\noutputs: {s: s.left}\n");
  ASSERT_TRUE(diagnostics.empty()) << diagnostics.text();
  EXPECT_EQ(std::get<std::vector<std::string>>(p.nodes[0].options[0]),
            (std::vector<std::string>{"$a", "x$a", "x$a$", "$x$a"}));
}

TEST_F(PipelineTest, APathThroughALinkStaysTheOneThatWasWritten) {
  namespace fs = std::filesystem;
  const fs::path here = scratch.path / "here", link = here / "link";
  fs::create_directories(scratch.path / "real" / "inner");
  fs::create_directory(here);
  fs::create_directory_symlink(scratch.path / "real" / "inner", link);
  const std::string text =
      "marrow: 1\ninputs: {x: {type: path}}\nnodes:\n  c: {uses: test.constant, with: {path: $x}}\n"
      "  d: {uses: test.constant, with: {path: here/link/../f}}\noutputs: {c: c, d: d}\n";
  const auto path_read = [&](const std::string& given, std::size_t node) {
    const Pipeline p = read(text, {{{"x", given}}, {}});
    EXPECT_TRUE(diagnostics.empty()) << diagnostics.text();
    return p.nodes.empty() ? "" : std::get<std::string>(p.nodes[node].options[6]);
  };
  EXPECT_EQ(path_read((link / "../f").string(), 0), (link / "../f").string()) << "real/f, as the system has it";
  EXPECT_EQ(path_read((here / "./../f").string(), 0), (scratch.path / "f").string());
  EXPECT_EQ(path_read("x", 1), (link / "../f").string());
}

TEST_F(PipelineTest, RenamedNodeIsPointedAtWhereItIsDefined) {
  read(
      "marrow: 1\nnodes:\n  lefft: {uses: test.constant}\n  n: {uses: test.add, in: {a: left, b: left}}\noutputs: {o: "
      "n}\n");
  const std::vector<marrow::Diagnostic> faults = diagnostics.sorted();
  ASSERT_EQ(faults.size(), 3u) << diagnostics.text();
  EXPECT_EQ(faults[0].place.line, 3);
  EXPECT_EQ(faults[0].message, "nothing uses node 'lefft'");
  EXPECT_EQ(faults[0].hint, "'left' is used, but is not there: is this it?");
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
  EXPECT_NE(places("marrow: 1\nnodes:\n  c: {uses: 'test.constant}\n  # all\n\n").find("3:13 this ' is not closed\n"),
            std::string::npos);
  EXPECT_NE(places("marrow: 1\nnodes:\n  c: {uses: [test.constant}\n  d: {}\n").find("3:13 this [ is not closed\n"),
            std::string::npos);
  EXPECT_EQ(places("marrow: 1\n\tnodes: {}\n").find("closed"), std::string::npos);
}
TEST_F(PipelineTest, UnreadableFile) {
  marrow::read_pipeline(scratch.path / "none.yaml", {}, test_catalogue(), diagnostics);
  EXPECT_NE(diagnostics.text().find("the pipeline file cannot be read"), std::string::npos);
}
TEST_F(PipelineTest, NoMap) { expect_fault("- a\n", 1, 1, "the pipeline must be a map, got a list"); }
TEST_F(PipelineTest, MissingVersion) {
  expect_fault("nodes: {c: {uses: test.constant}}\noutputs: {o: c}\n", 1, 1, "the key 'marrow' is missing");
}
TEST_F(PipelineTest, OtherVersion) {
  expect_fault("marrow: 2\nnodes: {c: {uses: test.constant}}\noutputs: {o: c}\n", 1, 1,
               "this file is of format 2, this program reads format 1");
}
TEST_F(PipelineTest, MissingOutputs) {
  expect_fault("marrow: 1\nnodes: {c: {uses: test.constant}}\n", 1, 1, "the key 'outputs' is missing");
}
TEST_F(PipelineTest, UnknownKey) {
  expect_fault("marrow: 1\nnode: {}\nnodes: {c: {uses: test.constant}}\noutputs: {o: c}\n", 2, 1, "unknown key 'node'",
               "did you mean 'nodes'?");
}
TEST_F(PipelineTest, DuplicateKey) {
  expect_fault("marrow: 1\nnodes:\n  c: {uses: test.constant}\n  c: {uses: test.sides}\noutputs: {o: c}\n", 4, 3,
               "'c' is given twice", "line 3");
}
TEST_F(PipelineTest, MergeKey) {
  expect_fault("marrow: 1\nnodes:\n  c: {uses: test.constant, <<: {with: {}}}\noutputs: {o: c}\n", 3, 28,
               "merge keys (<<) are not supported");
}
TEST_F(PipelineTest, UnknownNode) {
  expect_node_fault("{uses: test.constnat}", 13, "unknown node 'test.constnat'", "did you mean 'test.constant'?");
}
TEST_F(PipelineTest, NodeWithoutName) {
  expect_fault("marrow: 1\nnodes:\n  \"\": {uses: test.constant}\noutputs: {o: \"\"}\n", 3, 3, "a node has no name",
               "write it as  name: {uses: kind.name}");
}
TEST_F(PipelineTest, MissingUses) { expect_node_fault("{with: {value: 1}}", 3, "node 'n' does not say what it uses"); }
TEST_F(PipelineTest, DotInName) {
  expect_fault("marrow: 1\nnodes:\n  a.b: {uses: test.constant}\n  c: {uses: test.constant}\noutputs: {o: c}\n", 3, 3,
               "has a dot");
}
TEST_F(PipelineTest, UnknownOption) {
  expect_node_fault("{uses: test.constant, with: {vlaue: 1}}", 35, "has no option 'vlaue'", "did you mean 'value'?");
}
TEST_F(PipelineTest, NumberExpected) {
  expect_node_fault("{uses: test.constant, with: {value: big}}", 35, "expected a number, got 'big'");
}
TEST_F(PipelineTest, QuotedNumberIsText) {
  expect_node_fault("{uses: test.constant, with: {value: \"1\"}}", 35, "expected a number, got '1'");
}
TEST_F(PipelineTest, NotANumber) {
  expect_node_fault("{uses: test.constant, with: {value: nan}}", 35, "expected a number, got 'nan'");
}
TEST_F(PipelineTest, BelowRange) {
  expect_node_fault("{uses: test.constant, with: {value: -2000}}", 35, "-2000 is below the least allowed, -1000");
}
TEST_F(PipelineTest, AboveRange) {
  expect_node_fault("{uses: test.constant, with: {value: 2000}}", 35, "2000 is above the most allowed, 1000");
}
TEST_F(PipelineTest, WholeNumberThatTheOptionCannotHold) {
  expect_node_fault("{uses: test.constant, with: {count: 5000000000}}", 35,
                    "5000000000 is above the most allowed, 2147483647");
}
TEST_F(PipelineTest, OctalLookingInteger) {
  expect_node_fault("{uses: test.constant, with: {count: 010}}", 35, "expected an integer, got '010'",
                    "write it without leading zeros");
}
TEST_F(PipelineTest, FractionForInteger) {
  expect_node_fault("{uses: test.constant, with: {count: 1.5}}", 35, "expected an integer, got '1.5'");
}
TEST_F(PipelineTest, YesIsNotTrue) {
  expect_node_fault("{uses: test.constant, with: {flag: yes}}", 35, "expected true or false, got 'yes'");
}
TEST_F(PipelineTest, UnknownChoice) {
  expect_node_fault("{uses: test.constant, with: {word: tow}}", 35, "'tow' is not one of its choices",
                    "did you mean 'two'?");
}
TEST_F(PipelineTest, ListExpected) {
  expect_node_fault("{uses: test.constant, with: {numbers: 3}}", 35, "expected a list, got '3'", "[a, b, c]");
}
TEST_F(PipelineTest, WrongLength) {
  expect_node_fault("{uses: test.constant, with: {point: [1, 2]}}", 35, "expected 3 numbers, got 2");
}
TEST_F(PipelineTest, UnknownInputName) {
  expect_node_fault("{uses: test.constant, with: {value: $v}}", 42, "the pipeline has no input 'v'");
}
TEST_F(PipelineTest, UnknownPort) {
  expect_node_fault("{uses: test.add, in: {a: c, bb: c}}", 34, "has no input 'bb'", "did you mean 'b'?");
}
TEST_F(PipelineTest, UnwiredPort) {
  expect_node_fault("{uses: test.add, in: {b: c}}", 3, "input 'a' of test.add is not wired");
}
TEST_F(PipelineTest, UnknownSource) {
  expect_node_fault("{uses: test.add, in: {a: d}}", 28, "there is no node 'd'", "did you mean 'c'?");
}
TEST_F(PipelineTest, UnknownOutput) {
  expect_node_fault("{uses: test.add, in: {a: s.lefft}}", 28, "node 's' has no output 'lefft'", "did you mean 'left'?");
}
TEST_F(PipelineTest, AmbiguousOutput) {
  expect_node_fault("{uses: test.add, in: {a: s}}", 28, "node 's' has several outputs and not just one metrics");
}
TEST_F(PipelineTest, ListForSingle) {
  expect_node_fault("{uses: test.add, in: {a: [c, c]}}", 28, "takes one metrics, not a list");
}
TEST_F(PipelineTest, TooManyPicks) {
  expect_node_fault("{uses: test.add, in: {a: s.left.x}}", 28, "'s.left.x' picks 'x', but it is no list");
}
TEST_F(PipelineTest, WrongType) {
  expect_fault(
      "marrow: 1\nnodes:\n  t: {uses: test.truth}\n  a: {uses: test.apply, in: {adder: c, to: c}}\n  c: {uses: "
      "test.constant}\noutputs: {o: c}\n",
      4, 30, "input 'adder' of test.apply expects adder, but 'c' is metrics");
}
TEST_F(PipelineTest, TruthOnlyForEvaluation) {
  expect_fault("marrow: 1\nnodes:\n  t: {uses: test.truth}\n  a: {uses: test.add, in: {a: t}}\noutputs: {o: a}\n", 4,
               28, "the truth may be wired only to nodes of a kind that may see it, not to test.add");
  read(
      "marrow: 1\nnodes:\n  t: {uses: test.truth}\n  c: {uses: test.constant}\n  a: {uses: judge.test, in: {of: c, "
      "truth: t}}\noutputs: {o: a}\n");
  EXPECT_TRUE(diagnostics.empty()) << diagnostics.text();
}
TEST_F(PipelineTest, Circle) {
  expect_fault(
      "marrow: 1\nnodes:\n  a: {uses: test.add, in: {a: b}}\n  b: {uses: test.add, in: {a: a}}\noutputs: {o: a}\n", 3,
      3, "these nodes wait for each other in a circle: a, b");
}
TEST_F(PipelineTest, MissingInputValue) {
  expect_fault(
      "marrow: 1\ninputs:\n  v: {type: number}\nnodes: {c: {uses: test.constant, with: {value: $v}}}\noutputs: {o: "
      "c}\n",
      3, 3, "input 'v' has no value", "v=VALUE");
}
TEST_F(PipelineTest, UnknownInputType) {
  expect_fault(
      "marrow: 1\ninputs:\n  v: {type: nummber, default: 1}\nnodes: {c: {uses: test.constant}}\noutputs: {o: c}\n", 3,
      7, "unknown type 'nummber'", "did you mean 'number'?");
}
TEST_F(PipelineTest, UnknownGivenInput) {
  expect_fault(
      "marrow: 1\ninputs: {value: {type: number, default: 1}}\nnodes: {c: {uses: test.constant}}\noutputs: {o: c}\n", 0,
      0, "the pipeline has no input 'valu'", "did you mean 'value'?", {{{"valu", "2"}}, {}});
}

const char* const kTwoNodes =
    "marrow: 1\nnodes:\n  c: {uses: test.constant, with: {value: 2}}\n  a: {uses: test.add, in: {a: c}}\noutputs: {o: "
    "a}\n";
TEST_F(PipelineTest, Overrides) {
  const Pipeline p = read(kTwoNodes, {{}, {{"c.value", "7"}, {"a.in.b", "c"}}});
  ASSERT_TRUE(diagnostics.empty()) << diagnostics.text();
  EXPECT_EQ(std::get<double>(p.nodes[0].options[0]), 7.0);
  EXPECT_EQ(p.nodes[1].wires.size(), 2u);
}
TEST_F(PipelineTest, OverriddenNodeLeavesItsOptionsBehind) {
  const Pipeline p = read(kTwoNodes, {{}, {{"c.uses", "test.draw"}}});
  ASSERT_TRUE(diagnostics.empty()) << diagnostics.text();
  EXPECT_EQ(p.nodes[0].info.name, "test.draw");
  ASSERT_EQ(p.notes.size(), 1u);
}
TEST_F(PipelineTest, OverrideOfUnknownNode) {
  expect_fault(kTwoNodes, 0, 0, "the pipeline has no node 'cc'", "did you mean 'c'?", {{}, {{"cc.value", "7"}}});
}
TEST_F(PipelineTest, OverrideOfUnknownOption) {
  expect_fault(kTwoNodes, 0, 0, "has no option 'valu'", "did you mean 'value'?", {{}, {{"c.valu", "7"}}});
}
TEST_F(PipelineTest, OverrideWithoutOption) {
  expect_fault(kTwoNodes, 0, 0, "an override is node.option=value", "", {{}, {{"c", "7"}}});
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
  EXPECT_NE(diagnostics.text().find(
                "p.yaml:3:13: error: unknown node 'test.constnat'\n    c: {uses: test.constnat}\n              ^\n"),
            std::string::npos)
      << diagnostics.text();
}

TEST_F(PipelineTest, AxesAreFound) {
  const Pipeline p = read(
      "marrow: 1\nnodes:\n  s: {uses: test.sides}\n  l: {uses: test.letters}\n  a: {uses: test.add, in: {a: s.both, b: "
      "l}}\n"
      "  n: {uses: test.sum, in: {items: a}}\noutputs: {o: n}\n");
  ASSERT_TRUE(diagnostics.empty()) << diagnostics.text();
  EXPECT_EQ(p.nodes[2].mapped_axes, (std::vector<std::string>{"side", "letter"}));
  EXPECT_EQ(p.nodes[3].mapped_axes, (std::vector<std::string>{"letter"})) << "the axis 'side' is consumed";
}

/// A pipeline of one node with a key before it.
std::string with_key(const std::string& key) {
  return "marrow: 1\n" + key + "\nnodes:\n  c: {uses: test.constant}\noutputs: {o: c}\n";
}

TEST_F(PipelineTest, NameIsNoPath) {
  const std::string told = "a pipeline's name becomes a file name: ";
  expect_fault(with_key("name: ../../x"), 2, 1, told + "'../../x' cannot be one, it holds '/'",
               "use at most 100 letters");
  expect_fault(with_key("name: .."), 2, 1, told + "'..' cannot be one, it begins with a dot",
               "use at most 100 letters");
  expect_fault(with_key("name: ''"), 2, 1, told + "'' cannot be one, it is empty");
  expect_fault(with_key("name: \"a\\e[2J\""), 2, 1, "it holds a control character");
  expect_fault(with_key("name: " + std::string(101, 'x')), 2, 1, "it has 101 bytes");
  EXPECT_EQ(read(with_key("name: größer, links (2)")).name, "größer, links (2)");
  EXPECT_TRUE(diagnostics.empty()) << diagnostics.text();
}

TEST_F(PipelineTest, NameFromTheFileIsNoPathEither) {
  for (const std::string& file :
       {std::string("...yaml"), std::string(".yaml"), std::string("a\nb.yaml"), std::string(120, 'x') + ".yaml"}) {
    diagnostics = Diagnostics();
    marrow::read_pipeline(scratch.write(file, with_key("help: x")), {}, test_catalogue(), diagnostics);
    ASSERT_EQ(diagnostics.size(), 1u) << file << diagnostics.text();
    EXPECT_NE(diagnostics.text().find("the pipeline takes its name from its file, and '"), std::string::npos)
        << diagnostics.text();
    EXPECT_NE(diagnostics.text().find("hint: add  name: ..."), std::string::npos);
    marrow::read_pipeline(scratch.write(file, with_key("name: x")), {}, test_catalogue(), diagnostics = Diagnostics());
    EXPECT_TRUE(diagnostics.empty()) << diagnostics.text();
  }
}

TEST_F(PipelineTest, NamesOfOutputsAreFileNames) {
  for (const char* name : {"a/b", "..", ".a", "' a'", "'a '", "'a\\b'"})
    expect_fault("marrow: 1\nnodes:\n  c: {uses: test.constant}\noutputs:\n  " + std::string(name) + ": c\n", 5, 3,
                 "an output's name becomes a file name: '", "use at most");
}

TEST_F(PipelineTest, NoControlCharactersInKeys) {
  expect_fault(
      "marrow: 1\nnodes:\n  \"a\\e[31m\": {uses: test.constant}\n  c: {uses: test.constant}\noutputs: {o: c}\n", 3, 3,
      "in nodes holds a control character", "write it without");
  expect_fault("marrow: 1\nnodes:\n  c: {uses: test.constant}\noutputs: {o: c, \"a\\nb\": c}\n", 4, 17,
               "in outputs holds a control character");
  EXPECT_EQ(diagnostics.text().find('\x1b'), std::string::npos);
}

TEST_F(PipelineTest, NoNodes) {
  expect_fault("marrow: 1\nnodes: {}\noutputs: {}\n", 1, 1, "the pipeline has no nodes", "name them under  nodes:");
}

TEST_F(PipelineTest, TooLongAFile) {
  read(with_key("#" + std::string(4000000, 'x')));
  ASSERT_EQ(diagnostics.size(), 1u);
  EXPECT_NE(diagnostics.text().find("the pipeline file is longer than 4 MB"), std::string::npos) << diagnostics.text();
}

TEST_F(PipelineTest, DeepNestingIsSaid) {
  for (const std::string& open : {std::string("["), std::string("{a: "), std::string("- "), std::string("? ")}) {
    std::string deep = "a:\n  ";
    for (int i = 0; i < 60000; ++i) deep += open;
    read(deep);
    ASSERT_EQ(diagnostics.size(), 1u) << open;
    EXPECT_NE(diagnostics.text().find("lists and maps are nested more than 100 deep"), std::string::npos)
        << diagnostics.text();
  }
  expect_fault(with_key("help: " + std::string(50, '[') + std::string(50, ']')), 2, 1,
               "help: expected a text, got a list");
}

TEST_F(PipelineTest, AliasesThatMultiplyAreSaid) {
  std::string bomb = "a0: &a0 [x, x, x, x, x, x, x, x, x, x]\n";
  for (int i = 1; i < 30; ++i) {
    bomb += "a" + std::to_string(i) + ": &a" + std::to_string(i) + " [";
    for (int k = 0; k < 10; ++k) bomb += (k ? ", *a" : "*a") + std::to_string(i - 1);
    bomb += "]\n";
  }
  read(bomb);
  ASSERT_EQ(diagnostics.size(), 1u);
  EXPECT_NE(diagnostics.text().find("aliases repeat more than 100000 values"), std::string::npos) << diagnostics.text();
  read("marrow: 1\nnodes: &a {b: *a}\n");
  EXPECT_NE(diagnostics.text().find(
                "p.yaml:2:15: error: cannot be read as YAML: an alias names a list or map that it is in itself"),
            std::string::npos)
      << diagnostics.text();
  const Pipeline p = read(
      "marrow: 1\nnodes:\n  c: {uses: test.constant, with: &options {value: 7}}\n  d: {uses: test.constant, with: "
      "*options}\noutputs: {o: c, p: d}\n");
  ASSERT_TRUE(diagnostics.empty()) << diagnostics.text();
  EXPECT_EQ(std::get<double>(p.nodes[1].options[0]), 7.0) << "aliases are good for something";
}

TEST_F(PipelineTest, SecondDocumentAndNulAreSaid) {
  expect_fault(with_key("help: x") + "---\nmarrow: 1\n", 6, 1, "the file goes on after the end of its first document");
  expect_fault(with_key("help: \"a\\0b\""), 2, 7, "a text holds the character NUL (\\0); take it out");
  read(with_key("help: x") + "...\n# the end\n");
  EXPECT_TRUE(diagnostics.empty()) << diagnostics.text();
}

TEST_F(PipelineTest, InputsThatMultiplyAreSaid) {
  std::string names;
  for (int i = 0; i < 20; ++i) names += "$a";
  read("marrow: 1\ninputs: {a: {type: text, default: " + std::string(20000, 'x') +
       "}}\nnodes:\n  s: {uses: test.sides, with: {names: [" + names + "]}}\noutputs: {o: s.left}\n");
  ASSERT_EQ(diagnostics.size(), 1u);
  EXPECT_LT(diagnostics.text().size(), 1000u);
  EXPECT_NE(diagnostics.text().find("the values of inputs make the pipeline longer than 256 kB"), std::string::npos)
      << diagnostics.text();
}

TEST_F(PipelineTest, SourcesComeFirstInTheFilesOrderOtherwise) {
  const Pipeline p = read(
      "marrow: 1\nnodes:\n  e: {uses: test.add, in: {a: d, b: c}}\n  a: {uses: test.constant}\n  d: {uses: test.add, "
      "in: {a: b}}\n"
      "  c: {uses: test.add, in: {a: a}}\n  b: {uses: test.constant}\n  f: {uses: test.add, in: {a: c}}\noutputs: {o: "
      "e, p: f}\n");
  ASSERT_TRUE(diagnostics.empty()) << diagnostics.text();
  std::string order;
  for (const marrow::PipelineNode& node : p.nodes) order += node.id;
  EXPECT_EQ(order, "acbfde");
  for (std::size_t i = 0; i < p.nodes.size(); ++i)
    for (const marrow::Wire& wire : p.nodes[i].wires)
      for (const marrow::Reference& source : wire.sources) EXPECT_EQ(p.nodes[std::size_t(source.node)].id, source.text);
  EXPECT_EQ(p.nodes[std::size_t(p.outputs[0].source.node)].id, "e");
}

/// Files of 64 kB that are as slow to read as they can be.
TEST_F(PipelineTest, SmallFilesTakeNoTime) {
  const auto file_of = [](const std::string& begin, const std::function<std::string(int)>& line,
                          const std::string& end) {
    std::string text = begin;
    for (int i = 0; text.size() < 63000; ++i) text += line(i);
    return text + end;
  };
  const auto id = [](int i) { return "n" + std::to_string(i); };
  const std::string head = "marrow: 1\nnodes:\n";
  std::string reverse = head;
  for (int i = 0; i < 1500; ++i) reverse += " " + id(i) + ": {uses: test.add, in: {a: " + id(i + 1) + "}}\n";
  const std::map<std::string, std::string> files{
      {"in reverse order", reverse + " n1500: {uses: test.constant}\noutputs: {o: n0}\n"},
      {"unknown nodes",
       file_of(
           head, [&](int i) { return " " + id(i) + ": {uses: t" + std::to_string(i) + "}\n"; }, "outputs: {o: n0}\n")},
      {"unknown sources", file_of(
                              head + " c: {uses: test.sum, in: {items: [",
                              [&](int i) { return "m" + std::to_string(i) + ", "; }, "c]}}\noutputs: {o: c}\n")},
      {"unknown among many",
       file_of(
           head, [&](int i) { return " " + id(i) + ": {uses: test.add, in: {a: m" + std::to_string(i) + "}}\n"; },
           "outputs: {o: n0}\n")},
      {"many wires", file_of(
                         head + " c: {uses: test.constant}\n s: {uses: test.sum, in: {items: [",
                         [](int) { return "c,"; }, "c]}}\noutputs: {o: s}\n")},
      {"unknown keys",
       file_of(
           head + " c: {uses: test.constant}\noutputs: {o: c}\n", [&](int i) { return id(i) + ":\n"; }, "")},
      {"the same key", file_of(
                           head, [](int) { return " c: {}\n"; }, "outputs: {o: c}\n")},
      {"numbers",
       file_of(
           head + " c: {uses: test.constant, with: {numbers: [", [](int) { return "1,"; }, "1]}}\noutputs: {o: c}\n")},
      {"no numbers",
       file_of(
           head + " c: {uses: test.constant, with: {numbers: [", [](int) { return "x,"; }, "1]}}\noutputs: {o: c}\n")},
      {"outputs",
       file_of(
           head + " c: {uses: test.constant}\noutputs:\n", [&](int i) { return " " + id(i) + ": c\n"; }, "")},
      {"inputs", file_of(
                     "marrow: 1\ninputs:\n", [&](int i) { return " " + id(i) + ": {type: path}\n"; },
                     "nodes: {c: {uses: test.constant}}\noutputs: {o: c}\n")},
      {"unknown inputs", file_of(
                             head + " c: {uses: test.constant, with: {path: ",
                             [&](int i) { return "$i" + std::to_string(i); }, "}}\noutputs: {o: c}\n")},
      {"dots", head + " c: {uses: test.constant}\noutputs: {o: c" + std::string(63000, '.') + "}\n"},
      {"a long name", head + " c: {uses: " + std::string(63000, 'x') + "}\noutputs: {o: c}\n"}};
  for (const auto& [what, text] : files) {
    const std::clock_t start = std::clock();
    read(text);
    const std::string shown = diagnostics.text();
    std::printf("%-20s %.3f s, %zu faults\n", what.c_str(), double(std::clock() - start) / CLOCKS_PER_SEC,
                diagnostics.size());
    EXPECT_LT(double(std::clock() - start) / CLOCKS_PER_SEC, 20) << what;
    EXPECT_LT(shown.size(), 200000u) << what;
  }
}

}  // namespace
