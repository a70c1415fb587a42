// SPDX-License-Identifier: Apache-2.0
// How the text of an override is read. The right answers follow from one rule: a text is taken letter by letter, unless
// it begins with [, {, " or '.
#include "tests/framework/pipeline/pipeline_fixture.hpp"

namespace given_texts_test {

using pipeline_fixture::PipelineTest;
namespace fs = std::filesystem;

const char* const kNodes =
    "marrow: 1\nname: n\ninputs: {data: {type: path, default: x}}\nnodes:\n"
    "  c: {uses: test.constant, with: {path: $data}}\n  s: {uses: test.sides}\noutputs: {o: c, b: s.both}\n";
constexpr std::size_t kValue = 0, kFlag = 2, kNumbers = 4, kPath = 6;  // options of test.constant

/// Texts in which YAML would see a comment, an anchor, an alias, a tag, a list, a map, a block, an empty value, or
/// blanks that do not count.
const std::vector<std::string> kTexts{
    "a #b", "#b",       "&a b", "*a",    "! b",    "!!str b", "- a",  "-",    "? a",   "a: b", ": b",
    "a:",   "%a",       "@a",   "`a`",   "|",      "| a",     ">",    "> x",  " a ",   "~",    "null",
    "true", "5",        "5e",   "---",   "...",    "a\nb",    "a\tb", "a, b", "a]b",   "a}",   "a\"b",
    "it's", "größe 漢", "\\n",  "a # b", "<<: *a", "=",       "0x10", "0123", "1_000", "a\\",  "\xF0\x9F\xA6\xB4"};

class GivenTexts : public PipelineTest {
 protected:
  marrow::Pipeline with(const std::string& key, const std::string& text) { return read(kNodes, {{}, {{key, text}}}); }
  void expect_one_fault(const std::string& key, const std::string& text, const std::string& message,
                        const std::string& hint = "") {
    with(key, text);
    const marrow::Diagnostic fault = only_fault();
    EXPECT_EQ(fault.place.file, "--set " + key + "=" + text);
    EXPECT_EQ(fault.message, message);
    EXPECT_HAS(fault.hint, hint);
  }
  template <class T>
  T option(const marrow::Pipeline& pipeline, std::size_t node, std::size_t option) {
    EXPECT_TRUE(diagnostics.empty()) << diagnostics.text();
    if (!diagnostics.empty()) return {};
    return std::get<T>(pipeline.nodes[node].options[option]);
  }
};

TEST_F(GivenTexts, AreThemselvesLetterByLetter) {
  for (const std::string& text : kTexts)
    EXPECT_EQ(option<std::string>(with("c.path", text), 0, kPath), (fs::current_path() / text).lexically_normal())
        << text;
  EXPECT_EQ(option<std::string>(with("c.path", ""), 0, kPath), "") << "no file";
}

TEST_F(GivenTexts, AreTheSameInTheResolvedPipeline) {
  for (const std::string& text : kTexts) {
    const marrow::Pipeline before = with("c.path", text);
    const marrow::Pipeline again = read(marrow::resolved_yaml(before));
    EXPECT_EQ(option<std::string>(again, 0, kPath), option<std::string>(before, 0, kPath)) << text;
  }
}

TEST_F(GivenTexts, InQuotesAreWhatIsQuoted) {
  for (const auto& [text, meant] : std::vector<std::pair<std::string, std::string>>{{"\"a b\"", "a b"},
                                                                                    {"'a #b'", "a #b"},
                                                                                    {"'it''s'", "it's"},
                                                                                    {"\"[a]\"", "[a]"},
                                                                                    {"\"\\\"x\\\"\"", "\"x\""},
                                                                                    {"\"a\\u00e4\"", "aä"},
                                                                                    {"' a '", " a "},
                                                                                    {"\"a\" ", "a"}})
    EXPECT_EQ(option<std::string>(with("c.path", text), 0, kPath), (fs::current_path() / meant).string()) << text;
  EXPECT_EQ(option<std::string>(with("c.path", "''"), 0, kPath), "");
}

TEST_F(GivenTexts, OfNumbersBooleansAndLists) {
  EXPECT_EQ(option<double>(with("c.value", "-4.5e1"), 0, kValue), -45);
  EXPECT_TRUE(option<bool>(with("c.flag", "true"), 0, kFlag));
  EXPECT_EQ(option<std::vector<double>>(with("c.numbers", "[1, -2.5]"), 0, kNumbers), (std::vector<double>{1, -2.5}));
  using Texts = std::vector<std::string>;
  EXPECT_EQ(option<Texts>(with("s.names", "[\"a #b\", '&c d', e f, \"! g\"]"), 1, 0),
            (Texts{"a #b", "&c d", "e f", "! g"}));
  expect_one_fault("c.value", "5 # five", "option 'value' of test.constant: expected a number, got '5 # five'");
  expect_one_fault("c.value", "!!str 5", "option 'value' of test.constant: expected a number, got '!!str 5'");
  expect_one_fault("c.value", "\"5\"", "option 'value' of test.constant: expected a number, got the quoted text \"5\"");
  expect_one_fault("c.value", "", "option 'value' of test.constant: expected a number, got ''");
  expect_one_fault("s.names", "a", "option 'names' of test.sides: expected a list, got 'a'", "write it as [a, b, c]");
}

TEST_F(GivenTexts, ThatBeginAsAListAndAreNotListsAreFaults) {
  const std::string list = "the value begins as a list, but cannot be read as one: ",
                    quoted = "the value begins as a quoted text, but cannot be read as one: ",
                    no_end = "end of sequence flow not found",
                    tag = "tags (! or !!name) are not read; put quotes around a text that begins so";
  expect_one_fault(
      "s.names", "[a", list + no_end,
      "a text in it with ' #', ': ', &, ! or * needs quotes; to give it as a text, put it in double quotes: "
      "\"[a\"");
  for (const char* text : {"[a #b]", "[a, b] #c]", "[a] #b"}) expect_one_fault("s.names", text, list + no_end);
  for (const char* text : {"[a], ", "[a], [b]", "[a]: b", "[a] b"}) {
    with("s.names", text);
    EXPECT_EQ(diagnostics.size(), 1u) << text << diagnostics.text();
  }
  expect_one_fault("s.names", "[a,\n b]", list + "it must be in one line");
  expect_one_fault("s.names", "[! b]", list + tag);
  expect_one_fault("s.names", "[!!str b]", list + tag);
  expect_one_fault("s.names", "[&a b]",
                   list +
                       "this begins with an anchor (&name) that no alias (*name) names; put quotes around a text that "
                       "begins so");
  expect_one_fault("c.path", "\"a", quoted + "illegal EOF in scalar",
                   "to give it as a text, put it in double quotes: \"\\\"a\"");
  expect_one_fault("c.path", "'a' b", quoted + no_end);
  expect_one_fault("c.path", "'a', 'b'", quoted + "it does not end as one");
}

TEST_F(GivenTexts, OfUsesAndMayFail) {
  EXPECT_EQ(with("c.uses", "\"test.draw\"").nodes.at(0).info.name, "test.draw");
  expect_one_fault("c.uses", "[test.draw]", "uses: expected a text, got a list of 1");
  expect_one_fault("c.may_fail", "true #no", "'may_fail' of node 'c': expected true or false, got 'true #no'");
}

TEST_F(GivenTexts, PathsOfInputsAreNotEmpty) {
  expect_fault(kNodes, 0, 0, "input 'data' is an empty path", "the folder in which you are is  .",
               {{{"data", ""}}, {}});
  read(
      "marrow: 1\ninputs: {data: {type: path, default: ''}}\nnodes:\n  c: {uses: test.constant, with: {path: $data}}\n"
      "outputs: {o: c}\n",
      {{{"data", ""}}, {}});
  EXPECT_TRUE(diagnostics.empty()) << "its default says that it may be: " << diagnostics.text();
}

/// In a file, YAML would remove a tag or an anchor from the text without a message, so these are faults.
TEST_F(GivenTexts, TagsAndAnchorsInAFileAreFaults) {
  const auto text = [](const std::string& path) {
    return "marrow: 1\nnodes:\n  c: {uses: test.constant, with: {path: " + path + "}}\noutputs: {o: c}\n";
  };
  for (const char* path : {"! b", "!!str 5", "!local b", "! 'b'"})
    expect_fault(text(path), 3, 41, "tags (! or !!name) are not read; put quotes around a text that begins so");
  expect_fault(text("&a b"), 3, 41, "this begins with an anchor (&name) that no alias (*name) names");
  for (const char* path : {"'! b'", "\"&a b\"", "a!b", "a & b"}) {
    read_good(text(path));
  }
}

}  // namespace given_texts_test
