// SPDX-License-Identifier: Apache-2.0
// How the text of an override is read. The right answers follow from one rule: a text is taken letter by letter, unless
// it begins with [, {, " or '.
#include <sys/stat.h>
#include <unistd.h>

#include "marrow/runtime/pipeline/named_files.hpp"
#include "marrow/runtime/run/keys.hpp"
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

TEST_F(GivenTexts, OfUsesAndMayFailAndPathsOfInputs) {
  EXPECT_EQ(with("c.uses", "\"test.draw\"").nodes.at(0).info.name, "test.draw");
  expect_one_fault("c.uses", "[test.draw]", "uses: expected a text, got a list of 1");
  expect_one_fault("c.may_fail", "true #no", "'may_fail' of node 'c': expected true or false, got 'true #no'");
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

// Which files a path names, and the digests of their content.

using marrow::content_of;
using runtime_fixture::Scratch;

class NamedFilesTest : public testing::Test {
 protected:
  NamedFilesTest() {
    fs::create_directories(folder / "sub");
    std::ofstream(folder / "b.txt") << "b";
    std::ofstream(folder / "sub" / "a.txt") << "a";
  }
  std::vector<std::string> names() {
    std::vector<std::string> names;
    for (const marrow::NamedFile& file : marrow::files_named_by(folder))
      names.push_back(file.name + (file.is_there ? "" : " (nowhere)"));
    return names;
  }
  std::string fault() { return MESSAGE_OF(marrow::files_named_by(folder)); }
  Scratch scratch;
  fs::path folder = fs::canonical(scratch.path) / "case";
};

TEST_F(NamedFilesTest, AreAllFilesBelowSorted) {
  EXPECT_EQ(names(), (std::vector<std::string>{"b.txt", "sub/a.txt"}));
  EXPECT_TRUE(marrow::files_named_by(folder / "absent").empty());
  EXPECT_EQ(marrow::files_named_by(folder / "b.txt").at(0).name, ".");
}

TEST_F(NamedFilesTest, ALinkInsideCountsAndALinkToNothingIsNoFault) {
  fs::create_symlink("b.txt", folder / "c.txt");
  fs::create_symlink("gone", folder / "d.txt");
  fs::create_symlink("self", folder / "self");
  EXPECT_EQ(names(), (std::vector<std::string>{"b.txt", "c.txt", "d.txt (nowhere)", "self (nowhere)", "sub/a.txt"}));
}

TEST_F(NamedFilesTest, LinksThatLeaveOrLeadToFoldersAreRefused) {
  fs::create_symlink(scratch.write("outside.txt", "x"), folder / "out.txt");
  EXPECT_EQ(fault(), (folder / "out.txt").string() + ": is a link to a place outside " + folder.string() +
                         "; copy it into the folder");
  fs::remove(folder / "out.txt");
  fs::create_directory_symlink("sub", folder / "link");
  EXPECT_EQ(fault(), (folder / "link").string() + ": is a link to a folder; put the folder itself there");
}

TEST_F(NamedFilesTest, AFolderThatCannotBeReadIsAFault) {
  if (geteuid() == 0) GTEST_SKIP() << "root may read everything";
  fs::permissions(folder / "sub", fs::perms::none);
  EXPECT_EQ(fault(), (folder / "sub").string() + ": cannot be read: Permission denied; all files of a folder count");
  fs::permissions(folder / "sub", fs::perms::owner_all);
}

TEST_F(NamedFilesTest, DigestFollowsContentNotTimes) {
  const fs::path file = folder / "b.txt";
  const marrow::Digest before = marrow::path_digest(folder);
  const auto written = fs::last_write_time(file);
  std::ofstream(file) << "B";
  fs::last_write_time(file, written);  // as an unlucky copy would
  EXPECT_NE(marrow::path_digest(folder), before);
  std::ofstream(file) << "b";
  EXPECT_EQ(marrow::path_digest(folder), before);
  fs::rename(file, folder / "c.txt");
  EXPECT_NE(marrow::path_digest(folder), before);
}

TEST_F(NamedFilesTest, DigestOfASettledFileSeesAWriteThatKeepsSizeAndTime) {
  const fs::path file = folder / "b.txt";
  sleep(3);  // then it is settled, and its digest is kept
  const marrow::Digest before = marrow::path_digest(file);
  const auto written = fs::last_write_time(file);
  std::ofstream(file) << "B";
  fs::last_write_time(file, written);
  EXPECT_NE(marrow::path_digest(file), before);
}

TEST(WrittenContent, OfAFileIsWhatItHolds) {
  const Scratch scratch;
  const marrow::Digest before = content_of(scratch.write("a", "text"));
  EXPECT_EQ(content_of(scratch.write("b", "text")), before) << "wherever it was moved to";
  EXPECT_NE(content_of(scratch.write("a", "texT")), before);
  EXPECT_NE(content_of(scratch.write("a", "")), before);
}

TEST(WrittenContent, OfAFolderIsAllBelowIt) {
  const Scratch scratch;
  for (const char* folder : {"one", "two"}) {
    fs::create_directories(scratch.path / folder / "inner");
    scratch.write(std::string(folder) + "/image.png", "pixels");
    scratch.write(std::string(folder) + "/inner/mask.png", "mask");
  }
  const marrow::Digest whole = content_of(scratch.path / "one");
  EXPECT_EQ(content_of(scratch.path / "two"), whole);
  fs::rename(scratch.path / "two/image.png", scratch.path / "two/other.png");
  EXPECT_NE(content_of(scratch.path / "two"), whole);
  fs::rename(scratch.path / "two/other.png", scratch.path / "two/image.png");
  EXPECT_EQ(content_of(scratch.path / "two"), whole);
  fs::remove(scratch.path / "two/inner/mask.png");
  EXPECT_NE(content_of(scratch.path / "two"), whole);
}

}  // namespace given_texts_test
