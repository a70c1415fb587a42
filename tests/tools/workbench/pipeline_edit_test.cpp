// SPDX-License-Identifier: Apache-2.0
// The editor of pipeline files: it makes each wanted change, and all other text stays.
#include "workbench/pipeline.hpp"

#include <sstream>

#include "marrow/base/yaml.hpp"
#include "tests/framework/fixture.hpp"

namespace {

using marrow::Diagnostics;
using marrow::Error;
using marrow::workbench::edited_text;
using marrow::workbench::PipelineEdit;
using marrow::workbench::yaml_scalar;
using Edit = PipelineEdit;
using enum PipelineEdit::What;

std::string fault_of(const std::string& text, const Edit& edit) {
  try {
    edited_text(text, edit);
  } catch (const Error& error) {
    return error.what();
  }
  return "";
}

/// The text of a pipeline with one node.
std::string with_node(const std::string& node) { return "marrow: 1\nnodes:\n" + node + "outputs: {o: n}\n"; }

struct Case {
  const char* before;
  Edit edit;
  const char* after;
};

TEST(PipelineEdit, ChangesOnePlaceInEachStyle) {
  const Case kCases[] = {
      {"  n: {uses: a.b, with: {low: 5, high: 7}}  # why\n",
       {option, "n", "low", "60"},
       "  n: {uses: a.b, with: {low: 60, high: 7}}  # why\n"},
      {"  n: {uses: a.b, with: {low: 5}}  # why\n",
       {option, "n", "high", "[1, 2]"},
       "  n: {uses: a.b, with: {low: 5, high: [1, 2]}}  # why\n"},
      {"  n: {uses: a.b}  # why\n", {option, "n", "low", "6"}, "  n: {uses: a.b, with: {low: 6}}  # why\n"},
      {"  n:\n    uses: a.b  # which\n",
       {option, "n", "low", "6"},
       "  n:\n    uses: a.b  # which\n    with: {low: 6}\n"},
      {"  n:\n    uses: a.b\n    with:   # all\n      low: 5   # lower\n\n      # upper\n      high: 7\n",
       {option, "n", "low", "6"},
       "  n:\n    uses: a.b\n    with:   # all\n      low: 6   # lower\n\n      # upper\n      high: 7\n"},
      {"  n:\n    uses: a.b\n    with:\n      low: 5   # lower\n",
       {option, "n", "high", "7"},
       "  n:\n    uses: a.b\n    with:\n      low: 5   # lower\n      high: 7\n"},
      {"  n:\n    with:\n      low: 5   # lower\n      high: 7 # upper\n    uses: a.b\n",
       {option, "n", "high", {}},
       "  n:\n    with:\n      low: 5   # lower\n    uses: a.b\n"},
      {"  n:\n    with:\n      low: 5\n    uses: a.b\n", {option, "n", "low", {}}, "  n:\n    uses: a.b\n"},
      {"  n: {uses: a.b, with: {low: 5}, in: {x: c}}\n", {option, "n", "low", {}}, "  n: {uses: a.b, in: {x: c}}\n"},
      {"  n: {uses: a.b, in: {x: c}, with: {low: 5}}\n", {option, "n", "low", {}}, "  n: {uses: a.b, in: {x: c}}\n"},
      {"  n: {with: {low: 5, high: 7}, uses: a.b}\n", {option, "n", "low", {}}, "  n: {with: {high: 7}, uses: a.b}\n"},
      {"  n: {uses: a.b, with: {low: 5,   # lower\n    high: 7}}\n",
       {option, "n", "high", {}},
       "  n: {uses: a.b, with: {low: 5   # lower\n    }}\n"},
      {"  n: {uses: a.b, with: {low: 5,   # lower\n    high: 7}}\n",
       {option, "n", "low", {}},
       "  n: {uses: a.b, with: {   # lower\n    high: 7}}\n"},
      {"  n: {uses: a.b, with: {low: 5, }}\n",
       {option, "n", "high", "7"},
       "  n: {uses: a.b, with: {low: 5, high: 7 }}\n"},
      {"  n: {uses: a.b, with: {}}\n", {option, "n", "low", "6"}, "  n: {uses: a.b, with: {low: 6}}\n"},
      {"  n:\n    uses: a.b\n    with:  # nothing yet\n",
       {option, "n", "low", "6"},
       "  n:\n    uses: a.b\n    with: {low: 6}  # nothing yet\n"},
      {"  \"n\": {\"uses\": a.b, \"with\": {'low':5, \"hi gh\": 'it''s: # {no} comment'}}\n",
       {option, "n", "hi gh", "x"},
       "  \"n\": {\"uses\": a.b, \"with\": {'low':5, \"hi gh\": x}}\n"},
      {"  n: {uses: a.b, with: {low: it's#1, high: a:b}}\n",
       {option, "n", "high", "\"c: d\""},
       "  n: {uses: a.b, with: {low: it's#1, high: \"c: d\"}}\n"},
      {"  n:\n    uses: a.b\n    with:\n      list:\n      - 1  # one\n      - 2\n      low: 5\n",
       {option, "n", "list", "[3]"},
       "  n:\n    uses: a.b\n    with:\n      list: [3]\n      low: 5\n"},
      {"  n:\n    uses: a.b\n    with:\n      text: >\n        long\n\n        text\n      low: 5\n",
       {option, "n", "text", "short"},
       "  n:\n    uses: a.b\n    with:\n      text: short\n      low: 5\n"},
      {"  n:\n    uses: a.b\n    with:\n      text: long\n        text # end\n      low: 5\n",
       {option, "n", "text", "short"},
       "  n:\n    uses: a.b\n    with:\n      text: short # end\n      low: 5\n"},
      {"  n: {uses: a.b, in: {x: c.d, y: [e, f]}}\n",
       {wire, "n", "y", "[e, g]"},
       "  n: {uses: a.b, in: {x: c.d, y: [e, g]}}\n"},
      {"  n: {uses: a.b, in: {x: c.d}}\n", {wire, "n", "x", {}}, "  n: {uses: a.b}\n"},
      {"  n: {uses: a.b, in: {x: c}, with: {low: 5}}  # why\n",
       {uses, "n", "", "a.c"},
       "  n: {uses: a.c, in: {x: c}}  # why\n"},
      {"  n:\n    uses: a.b  # which\n    with:\n      low: 5\n    in: {x: c}\n",
       {uses, "n", "", "a.c"},
       "  n:\n    uses: a.c  # which\n    in: {x: c}\n"},
      {"  n: {uses: a.b, with: {low: 5}}\n", {uses, "n", "", "a.b"}, "  n: {uses: a.b, with: {low: 5}}\n"},
      {"  n: {uses: a.b}\n", {may_fail, "n", "", "true"}, "  n: {uses: a.b, may_fail: true}\n"},
      {"  n: {uses: a.b, may_fail: true}\n", {may_fail, "n", "", {}}, "  n: {uses: a.b}\n"},
  };
  for (const Case& one : kCases) EXPECT_EQ(edited_text(with_node(one.before), one.edit), with_node(one.after));
}

TEST(PipelineEdit, KeepsLineEndsAndTheByteOrderMark) {
  std::string text =
      "\xEF\xBB\xBF" + with_node("  n:\n    uses: a.b\n    with:\n      low: 5  # \xC3\xBC\n      up: 7\n");
  std::string wanted = text;
  const auto crlf = [](std::string one) {
    for (std::size_t i = 0; (i = one.find('\n', i)) != std::string::npos; i += 2) one.insert(i, "\r");
    return one;
  };
  wanted.insert(wanted.find("\noutputs"), "\n      high: 8");
  EXPECT_EQ(edited_text(crlf(text), {option, "n", "high", "8"}), crlf(wanted));
  wanted = text;
  wanted.replace(wanted.find('5'), 1, "6");
  EXPECT_EQ(edited_text(crlf(text), {option, "n", "low", "6"}), crlf(wanted));
}

TEST(PipelineEdit, TheLastLineMayEndWithoutALineBreak) {
  const std::string text = "outputs: {o: n}\nnodes:\n  n:\n    uses: a.b\n    with:\n      low: 5\n      up: 7";
  EXPECT_EQ(edited_text(text, {option, "n", "high", "8"}), text + "\n      high: 8");
  EXPECT_EQ(edited_text(text, {option, "n", "up", {}}), text.substr(0, text.rfind('\n')));
}

TEST(PipelineEdit, ALongLineIsBroken) {
  const std::string name(60, 'x'), other(40, 'y');
  const std::string before = "  n: {uses: a.b, with: {" + name + ": 1, low: 5}}";
  EXPECT_EQ(edited_text(with_node(before + "\n"), {option, "n", other, "6"}),
            with_node(before.substr(0, before.size() - 2) + ",\n    " + other + ": 6}}\n"));
}

TEST(PipelineEdit, SaysWhatItDoesNotChange) {
  EXPECT_EQ(fault_of(with_node("  n: &n {uses: a.b}\n"), {option, "n", "low", "5"}),
            "line 3: anchors and aliases (&name, *name) are not read; write the value out; change it in the text");
  EXPECT_EQ(fault_of(with_node("  n: {uses: a.b}\n"), {option, "m", "low", "5"}),
            "the pipeline has no node 'm'; did you mean 'n'?");
  EXPECT_EQ(fault_of(with_node("  n: {uses: a.b, with: [1]}\n"), {option, "n", "low", "5"}),
            "'with' of node 'n' is no map; change it in the text");
  EXPECT_EQ(fault_of(with_node("  n: {uses: a.b, with: {low: 1, low: 2}}\n"), {option, "n", "low", "5"}),
            "line 3: the key 'low' occurs twice; change it in the text");
  EXPECT_EQ(fault_of("nodes: [", {option, "n", "low", "5"}),
            "line 1: end of sequence flow not found; change it in the text");
  EXPECT_EQ(fault_of("[]", {option, "n", "low", "5"}), "the pipeline has no nodes; change it in the text");
  EXPECT_EQ(fault_of(with_node("  n: {uses: a.b}\n"), {uses, "n", "", {}}), "node 'n' must use something");
}

TEST(PipelineEdit, AValueNeverBecomesMoreThanAValue) {
  const std::string text = with_node("  n: {uses: a.b, with: {low: 5}}\n");
  for (const char* value : {"1, high: 3", "1}, may_fail: true, x: {y: 2", "6 # rest", "a]", "\"open"})
    EXPECT_NE(fault_of(text, {option, "n", "low", value}), "") << value;
  EXPECT_EQ(fault_of(text, {option, "n", "low", "1\n  m: {uses: c.d}"}), "n.low needs a value on one line");
  EXPECT_EQ(fault_of(text, {option, "n", "low", ""}), "n.low needs a value on one line");
  EXPECT_EQ(fault_of(text, {option, "n", "low", "1, high: 3"}),
            "n.low cannot be changed here, because the file would then say something else; change it in the text");
}

TEST(PipelineEdit, TextsReadBackAsTheyAre) {
  for (const char* text :
       {"plain", "two words", "5", "true", "no",   "",         " edge", "a: b",  "a #b", "{x}", "[1]", "\"q\"", "it's",
        "-",     "- a",       "~", "null", "a\nb", "\xC3\xBC", "1e5",   "$case", "*x",   "&x",  "a,b", "?"}) {
    const YAML::Node map = YAML::Load("{k: " + yaml_scalar(text) + "}");
    ASSERT_TRUE(map["k"].IsScalar()) << text;
    EXPECT_EQ(map["k"].Scalar(), text);
    EXPECT_FALSE(marrow::yaml_number(map["k"]).has_value()) << text;
  }
  EXPECT_EQ(yaml_scalar("$case"), "$case");
  EXPECT_EQ(yaml_scalar("no"), "\"no\"");
}

std::vector<std::string> lines_of(const std::string& text) {
  std::vector<std::string> lines;
  std::istringstream stream(text);
  for (std::string line; std::getline(stream, line);) lines.push_back(line);
  return lines;
}

/// The first and the last line of `before`, from 1, that differ in `after`.
std::pair<std::size_t, std::size_t> changed_lines(const std::string& before, const std::string& after) {
  const auto a = lines_of(before), b = lines_of(after);
  std::size_t same = 0, behind = 0;
  while (same < std::min(a.size(), b.size()) && a[same] == b[same]) ++same;
  while (behind < std::min(a.size(), b.size()) - same && a[a.size() - 1 - behind] == b[b.size() - 1 - behind]) ++behind;
  return {same + 1, a.size() - behind};
}

/// All possible edits of a node: each option and wire changed, added and removed, and another node.
std::vector<Edit> edits_of(const std::string& id, const YAML::Node& node) {
  std::vector<Edit> edits{
      {option, id, "new_option", "[1, 2]"}, {wire, id, "new_port", "other.output"}, {may_fail, id, "", "true"}};
  if (node["uses"]) edits.push_back({uses, id, "", "other.node"});
  for (const auto& [key, what] : {std::pair("with", option), std::pair("in", wire)})
    if (node[key])
      for (const auto& pair : node[key]) {
        edits.push_back({what, id, pair.first.Scalar(), "12.5"});
        edits.push_back({what, id, pair.first.Scalar(), std::nullopt});
      }
  return edits;
}

TEST(PipelineEdit, InShippedPipelinesOnlyTheLinesOfTheNodeChange) {
  std::size_t count = 0;
  for (const char* name : {"femur/femur", "femur/femur-best", "femur/landmarks", "femur/markers", "femur/study2",
                           "simulate/simulate", "track/track", "wrist/wrist"}) {
    const auto file = std::filesystem::path(MARROW_SOURCE_DIR "/pipelines") / (std::string(name) + ".yaml");
    std::stringstream stream;
    stream << std::ifstream(file).rdbuf();
    const std::string text = stream.str();
    const YAML::Node root = YAML::Load(text);
    std::set<std::size_t> begins{lines_of(text).size() + 1};
    for (const auto& pair : root) begins.insert(std::size_t(pair.first.Mark().line) + 1);
    for (const auto& pair : root["nodes"]) begins.insert(std::size_t(pair.first.Mark().line) + 1);
    for (const auto& pair : root["nodes"]) {
      if (!pair.second.IsMap()) continue;  // null, which removes the node of another file
      for (const Edit& edit : edits_of(pair.first.Scalar(), pair.second)) {
        SCOPED_TRACE(file.string() + ": " + edit.in_words());
        const std::size_t begin = std::size_t(pair.first.Mark().line) + 1;
        const std::string edited = edited_text(text, edit);
        if (edit.what == may_fail && pair.second["may_fail"]) {
          EXPECT_EQ(edited, text);
          continue;
        }
        const auto [first, last] = changed_lines(text, edited);
        EXPECT_GE(first, begin);
        EXPECT_LE(last, *begins.upper_bound(begin) - 1);
        ++count;
      }
    }
  }
  EXPECT_GT(count, 400u);
}

/// Reads a text as a pipeline of the test nodes.
class EditedPipeline : public testing::Test {
 protected:
  std::string resolved(const std::string& text, const marrow::PipelineArguments& arguments = {}) {
    Diagnostics faults;
    const auto file = scratch.write("p.yaml", text);
    const marrow::Pipeline pipeline = marrow::read_pipeline(file, arguments, runtime_fixture::test_catalogue(), faults);
    EXPECT_TRUE(faults.empty()) << faults.text() << text;
    return faults.empty() ? marrow::resolved_yaml(pipeline) : "";
  }
  runtime_fixture::Scratch scratch;
};

TEST_F(EditedPipeline, IsThePipelineThatSetWouldGive) {
  const std::string texts[] = {
      "marrow: 1\nname: p\nnodes:\n  c: {uses: test.constant, with: {value: 5, word: two}}\n"
      "  d: {uses: test.constant}\n  s: {uses: test.add, in: {a: c, b: d}}\noutputs: {o: s}\n",
      "marrow: 1\nname: p\nnodes:\n  c:\n    with:   # of c\n      # the value\n      value: 5  # five\n"
      "      word: two\n    uses: test.constant\n  d:\n    uses: \"test.constant\"\n"
      "  s:\n    uses: test.add\n    in:\n      a: c\n      b: d  # last\noutputs:\n  o: s\n"};
  const Edit kEdits[] = {
      {option, "c", "value", "-7.5"}, {option, "c", "numbers", "[1, 2.5]"}, {option, "c", "flag", "true"},
      {option, "d", "word", "three"}, {option, "d", "path", "\"a file\""},  {option, "c", "point", "[1, 2, 3]"},
      {wire, "s", "a", "d"},          {uses, "c", "", "test.draw"},         {may_fail, "s", "", "true"},
      {uses, "d", "", "test.warn"}};
  for (const std::string& text : texts)
    for (const Edit& edit : kEdits) {
      SCOPED_TRACE(edit.in_words());
      const marrow::PipelineArguments set{{}, {{edit.key(), *edit.value, {(scratch.path / "p.yaml").string(), 1, 1}}}};
      const std::string edited = edited_text(text, edit);
      EXPECT_EQ(resolved(edited), resolved(text, set));
      EXPECT_NE(resolved(edited), resolved(text));
    }
}

TEST_F(EditedPipeline, RemovingAnOptionGivesItsDefault) {
  const std::string text =
      "marrow: 1\nname: p\nnodes:\n  c: {uses: test.constant, with: {value: 5, word: two}}\noutputs: {o: c}\n";
  const std::string without = edited_text(text, {option, "c", "word", {}});
  EXPECT_EQ(resolved(without), resolved(text, {{}, {{"c.word", "one"}}}));
  EXPECT_EQ(resolved(edited_text(without, {option, "c", "word", "two"})), resolved(text));
}

}  // namespace
