// SPDX-License-Identifier: Apache-2.0
// What is read from a good pipeline file, and how overrides change it.
#include "marrow/base/file_names.hpp"
#include "tests/framework/pipeline/pipeline_fixture.hpp"

namespace pipeline_test {

using marrow::Pipeline;
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
    const Pipeline again = read_good(marrow::resolved_yaml(p));
    for (std::size_t i = 0; i < p.nodes.size(); ++i)
      EXPECT_EQ(again.nodes[i].options, p.nodes[i].options) << marrow::resolved_yaml(p);
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
  for (const auto& arguments : {marrow::PipelineArguments{}, marrow::PipelineArguments{{{"x", ""}}, {}}}) {
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
TEST_F(PipelineTest, OverrideOfUnknownNode) {
  expect_fault(kTwoNodes, 0, 0, "the pipeline has no node 'cc'", "did you mean 'c'?", {{}, {{"cc.value", "7"}}});
}
TEST_F(PipelineTest, OverrideOfUnknownOption) {
  expect_fault(kTwoNodes, 0, 0, "has no option 'valu'", "did you mean 'value'?", {{}, {{"c.valu", "7"}}});
}
TEST_F(PipelineTest, OverrideWithoutOption) {
  expect_fault(kTwoNodes, 0, 0, "an override is node.option=value", "", {{}, {{"c", "7"}}});
}

TEST_F(PipelineTest, AxesAreFound) {
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
  for (const marrow::PipelineNode& node : p.nodes) order += node.id;
  EXPECT_EQ(order, "acbfde");
  for (std::size_t i = 0; i < p.nodes.size(); ++i)
    for (const marrow::Wire& wire : p.nodes[i].wires)
      for (const marrow::Reference& source : wire.sources) EXPECT_EQ(p.node_of(source).id, source.text);
  EXPECT_EQ(p.node_of(p.outputs[0].source).id, "e");
}

}  // namespace pipeline_test
