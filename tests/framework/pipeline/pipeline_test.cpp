// SPDX-License-Identifier: Apache-2.0
// What is read from a good pipeline file, and how overrides change it.

#include "marrow/base/file_names.hpp"
#include "tests/framework/pipeline/pipeline_fixture.hpp"

namespace pipeline_test {

using namespace marrow;
using pipeline_fixture::PipelineTest;

TEST_F(PipelineTest, GoodFileIsResolved) {
  const Pipeline p = read_good(
      "marrow: 1\ninputs: {v: {type: number, default: 3}}\nnodes:\n  add: {uses: test.add, in: {a: c, b: s.left}}\n"
      "  c: {uses: test.constant, with: {value: $v, word: two, point: [1, 2, 3]}}\n  s: {uses: test.sides}\noutputs: "
      "{o: add}\n");
  ASSERT_EQ(p.nodes.size(), 3u);
  EXPECT_EQ(p.nodes[2].id, "add") << "sources come before users";
  EXPECT_EQ(std::get<double>(p.nodes[0].options[0]), 3.0);
  EXPECT_EQ(std::get<std::string>(p.nodes[0].options[3]), "two");
  const std::string text =
      "marrow: 1\nnodes:\n  c: {uses: test.constant, with: {value: 0.1, numbers: [1.5, 2]}}\n  s: {uses: test.sides}\n"
      "  n: {uses: test.sum, in: {items: [c, s.left]}}\noutputs: {o: n, p: s.both.a}\n";
  const std::string once = resolved_yaml(read(text));
  ASSERT_TRUE(diagnostics.empty()) << diagnostics.text();
  EXPECT_EQ(resolved_yaml(read(once)), once);
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
    const bool is_name = fault_of_name(text).empty();
    if (is_name) p.name = text;
    const Pipeline again = read_good(resolved_yaml(p));
    for (std::size_t i = 0; i < p.nodes.size(); ++i)
      EXPECT_EQ(again.nodes[i].options, p.nodes[i].options) << resolved_yaml(p);
    if (is_name) {
      EXPECT_EQ(again.name, text);
    }
  }
}

TEST_F(PipelineTest, TwoDollarsAreOneAndNoNameOfAnInput) {
  const Pipeline p = read_good(
      "marrow: 1\ninputs: {a: {type: text, default: x$a}}\nnodes:\n  s: {uses: test.sides, with: {names: [$$a, $a, "
      "$a$$, $$$a]}}\noutputs: {s: s.left}\n");
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
    const Pipeline p = read_good(text, {{{"x", given}}, {}});
    return p.nodes.empty() ? "" : std::get<std::string>(p.nodes[node].options[6]);
  };
  EXPECT_EQ(path_read((link / "../f").string(), 0), (link / "../f").string()) << "real/f, as the system has it";
  EXPECT_EQ(path_read((here / "./../f").string(), 0), (scratch.path / "f").string());
  EXPECT_EQ(path_read("x", 1), (link / "../f").string());
}

TEST_F(PipelineTest, AnEmptyPathStaysEmpty) {
  const std::string text =
      "marrow: 1\ninputs: {x: {type: path, default: \"\"}}\nnodes:\n  c: {uses: test.constant, with: {path: $x}}\n"
      "outputs: {c: c}\n";
  for (const auto& arguments : {PipelineArguments{}, PipelineArguments{{{"x", ""}}, {}}}) {
    const Pipeline p = read_good(text, arguments);
    EXPECT_EQ(std::get<std::string>(p.nodes[0].options[6]), "") << "not the folder of the pipeline";
  }
}

const char* const kTwoNodes =
    "marrow: 1\nnodes:\n  c: {uses: test.constant, with: {value: 2}}\n  a: {uses: test.add, in: {a: c}}\noutputs: {o: "
    "a}\n";
TEST_F(PipelineTest, Overrides) {
  const Pipeline p = read_good(kTwoNodes, {{}, {{"c.value", "7"}, {"a.in.b", "c"}}});
  EXPECT_EQ(std::get<double>(p.nodes[0].options[0]), 7.0);
  EXPECT_EQ(p.nodes[1].wires.size(), 2u);
}
TEST_F(PipelineTest, OverriddenNodeLeavesItsOptionsBehind) {
  const Pipeline p = read_good(kTwoNodes, {{}, {{"c.uses", "test.draw"}}});
  EXPECT_EQ(p.nodes[0].info.name, "test.draw");
  ASSERT_EQ(p.notes.size(), 1u);
}
TEST_F(PipelineTest, OverridesOfReplacedNodeKeepTheirOwnValues) {
  const Pipeline p = read_good("marrow: 1\nnodes: {c: {uses: test.sides, with: {names: [a]}}}\noutputs: {o: c}\n",
                               {{}, {{"c.value", "7"}, {"c.count", "5"}, {"c.uses", "test.constant"}}});
  EXPECT_EQ(std::get<double>(p.nodes[0].options[0]), 7.0);
  EXPECT_EQ(std::get<std::int64_t>(p.nodes[0].options[1]), 5);
}
TEST_F(PipelineTest, OverrideLeavesAliasesAlone) {
  const Pipeline p = read_good(
      "marrow: 1\nnodes:\n  c: {uses: test.constant, with: &o {value: 2}}\n  d: {uses: test.constant, with: *o}\n"
      "outputs: {o: c, p: d}\n",
      {{}, {{"c.value", "7"}}});
  EXPECT_EQ(std::get<double>(p.nodes[0].options[0]), 7.0);
  EXPECT_EQ(std::get<double>(p.nodes[1].options[0]), 2.0);
}
TEST_F(PipelineTest, FaultsOfOverridesAndAxes) {
  expect_fault(kTwoNodes, 0, 0, "the pipeline has no node 'cc'", "did you mean 'c'?", {{}, {{"cc.value", "7"}}});
  expect_fault(kTwoNodes, 0, 0, "has no option 'valu'", "did you mean 'value'?", {{}, {{"c.valu", "7"}}});
  expect_fault(kTwoNodes, 0, 0, "an override is node.option=value", "", {{}, {{"c", "7"}}});
  const Pipeline p = read_good(
      "marrow: 1\nnodes:\n  s: {uses: test.sides}\n  l: {uses: test.letters}\n  a: {uses: test.add, in: {a: s.both, b: "
      "l}}\n"
      "  n: {uses: test.sum, in: {items: a}}\noutputs: {o: n}\n");
  EXPECT_EQ(p.nodes[2].mapped_axes, (std::vector<std::string>{"side", "letter"}));
  EXPECT_EQ(p.nodes[3].mapped_axes, (std::vector<std::string>{"letter"})) << "the axis 'side' is consumed";
}

TEST_F(PipelineTest, SourcesComeFirstInTheFilesOrderOtherwise) {
  const Pipeline p = read_good(
      "marrow: 1\nnodes:\n  e: {uses: test.add, in: {a: d, b: c}}\n  a: {uses: test.constant}\n  d: {uses: test.add, "
      "in: {a: b}}\n"
      "  c: {uses: test.add, in: {a: a}}\n  b: {uses: test.constant}\n  f: {uses: test.add, in: {a: c}}\noutputs: {o: "
      "e, p: f}\n");
  std::string order;
  for (const PipelineNode& node : p.nodes) order += node.id;
  EXPECT_EQ(order, "acbfde");
  for (std::size_t i = 0; i < p.nodes.size(); ++i)
    for (const Wire& wire : p.nodes[i].wires)
      for (const Reference& source : wire.sources) EXPECT_EQ(p.node_of(source).id, source.text);
  EXPECT_EQ(p.node_of(p.outputs[0].source).id, "e");
}

// Calls of one node with values from memory.

using Inputs = std::vector<std::pair<std::string, Value>>;
using Options = std::vector<std::pair<std::string, std::string>>;

Value number(double value) {
  return Value::of<Metrics>(std::make_shared<const Metrics>(Metrics{{{"value", value, ""}}}));
}

Value list_of(const std::vector<double>& values, const std::string& axis) {
  Value list = number(0);
  list.data.reset();
  list.axis = axis;
  for (std::size_t i = 0; i < values.size(); ++i) {
    list.names.push_back(std::string(1, char('a' + i)));
    list.items.push_back(number(values[i]));
  }
  return list;
}

double number_in(const Value& value) { return value.as<Metrics>().items.at(0).value; }

/// Calls the node, which must succeed, and returns its output.
Value called(const std::string& name, const Inputs& inputs, const Options& options = {}) {
  Diagnostics diagnostics;
  const Catalogue& catalogue = runtime_fixture::test_catalogue();
  const OneNode one = pipeline_of_node(name, inputs, options, catalogue, diagnostics);
  EXPECT_TRUE(diagnostics.empty()) << diagnostics.text();
  RunSettings settings;
  settings.given = one.given;
  const RunResult result = run_pipeline(one.pipeline, catalogue, settings);
  EXPECT_FALSE(result.failed());
  return value_of(result, one.pipeline.outputs.at(0).source);
}

/// All faults, one a line.
std::string faults(const std::string& name, const Inputs& inputs, const Options& options = {}) {
  Diagnostics diagnostics;
  pipeline_of_node(name, inputs, options, runtime_fixture::test_catalogue(), diagnostics);
  std::string text;
  for (const Diagnostic& one : diagnostics.sorted())
    text += one.place.file + ": " + one.message + (one.hint.empty() ? "" : " [" + one.hint + "]") + "\n";
  return text;
}

TEST(OneNodeTest, TakesInputsAndOptionsAndIsCalledForEachItem) {
  EXPECT_EQ(number_in(called("test.add", {{"a", number(2)}, {"b", number(5)}})), 7);
  EXPECT_EQ(number_in(called("test.constant", {}, {{"value", "3.5"}})), 3.5);
  const Value sums = called("test.add", {{"a", list_of({1, 2}, "letter")}, {"b", number(10)}});
  EXPECT_EQ(sums.axis, "letter");
  EXPECT_EQ(sums.names, (std::vector<std::string>{"a", "b"}));
  EXPECT_EQ(number_in(sums.items.at(1)), 12);
  EXPECT_EQ(number_in(called("test.sum", {{"items", list_of({1, 2, 4}, "side")}})), 7) << "taken whole";
}

TEST(OneNodeTest, NestsListsOverDifferentAxes) {
  const Value sums = called("test.add", {{"a", list_of({1, 2}, "row")}, {"b", list_of({10, 20, 30}, "column")}});
  EXPECT_EQ(sums.axis, "row");
  EXPECT_EQ(sums.items.at(1).axis, "column");
  EXPECT_EQ(number_in(sums.items.at(1).items.at(2)), 32);
}

TEST(OneNodeTest, AllFaultsComeAtOnceWithTheirPlaces) {
  const Value other = Value::of<Stop>(std::make_shared<const Stop>());
  EXPECT_EQ(faults("test.add", {{"a", other}, {"c", number(1)}}, {{"valu", "1"}}),
            "test.add(a): input 'a' of test.add expects metrics, got stop [first]\n"
            "test.add(c): 'test.add' has no input 'c' [did you mean 'a'?]\n"
            "test.add(valu): 'test.add' has no option 'valu' [there are none]\n");
  EXPECT_EQ(faults("test.add", {}), "test.add(a): test.add needs the input 'a', of type metrics [first]\n");
  EXPECT_EQ(number_in(called("test.add", {{"a", number(2)}})), 2) << "the other input is optional";
  EXPECT_HAS(faults("test.constant", {}, {{"count", "-1"}, {"value", "much"}}),
             "option 'count' of test.constant: -1 is below the least allowed, 0\n");
  EXPECT_HAS(faults("test.constant", {}, {{"count", "-1"}, {"value", "much"}}),
             "option 'value' of test.constant: expected a number");
  EXPECT_EQ(faults("test.ad", {}), "test.ad: unknown node 'test.ad' [did you mean 'test.add'?]\n");
  const std::string found = faults("test.any", {});
  EXPECT_EQ(std::count(found.begin(), found.end(), '\n'), 1) << found;
  EXPECT_HAS(found, "'in.items'");
  EXPECT_HAS(found, "'in.adder'");
}

}  // namespace pipeline_test
