// SPDX-License-Identifier: Apache-2.0
// Names that become names of files.
#include "marrow/base/file_names.hpp"

#include <random>

#include "tests/framework/fixture.hpp"

namespace file_names_test {

using marrow::fault_of_name;
using marrow::file_name_of;
using Texts = std::vector<std::string>;

TEST(FileNames, GoodOnesAndBadOnesAndWhy) {
  for (const char* name :
       {"femur", "a b", "a.b", "1", "-5", "canny+bobyqa", "größer", "\u6f22", "a..b", "x.", "[1,_2]"})
    EXPECT_EQ(fault_of_name(name), "") << name;
  EXPECT_EQ(fault_of_name(std::string(100, 'x')), "");
  EXPECT_EQ(fault_of_name(""), "it is empty");
  EXPECT_EQ(fault_of_name(".."), "it begins with a dot");
  EXPECT_EQ(fault_of_name("."), "it begins with a dot");
  EXPECT_EQ(fault_of_name(".hidden"), "it begins with a dot");
  EXPECT_EQ(fault_of_name("../../x"), "it holds '/'");
  EXPECT_EQ(fault_of_name("/etc"), "it holds '/'");
  EXPECT_EQ(fault_of_name("a\\b"), "it holds '\\'");
  EXPECT_EQ(fault_of_name(" a"), "it begins with a space");
  EXPECT_EQ(fault_of_name("a "), "it ends with a space");
  EXPECT_EQ(fault_of_name(std::string(101, 'x')), "it has 101 bytes");
  for (const std::string& name :
       {std::string("a\nb"), std::string("a\tb"), std::string("\x1b[2J"), std::string("a\0b", 3), std::string("a\x7f"),
        std::string("\u202e"), std::string("\u009b")})
    EXPECT_EQ(fault_of_name(name), "it holds a control character") << name;
  EXPECT_EQ(fault_of_name("\xff"), "it holds bytes that are not UTF-8");
}

/// Names that look like "ab" or "é". The code points are those of the Unicode standard.
TEST(FileNames, ThatLookLikeOthersAndWhy) {
  for (const auto& [name, code] : std::vector<std::pair<std::string, std::string>>{{"a\u200bb", "U+200B"},
                                                                                   {"a\u200cb", "U+200C"},
                                                                                   {"a\u200db", "U+200D"},
                                                                                   {"ab\u2060", "U+2060"},
                                                                                   {"\ufeffab", "U+FEFF"},
                                                                                   {"a\u00adb", "U+00AD"},
                                                                                   {"ab\ufe0f", "U+FE0F"},
                                                                                   {"ab\U000e0041", "U+E0041"}})
    EXPECT_EQ(fault_of_name(name), "it holds " + code + ", which cannot be seen");
  for (const auto& [name, code] : std::vector<std::pair<std::string, std::string>>{
           {"a\u00a0b", "U+00A0"}, {"a\u2009b", "U+2009"}, {"a\u3000b", "U+3000"}, {"a\u202fb", "U+202F"}})
    EXPECT_EQ(fault_of_name(name), "it holds " + code + ", a blank that is not a space");
  EXPECT_EQ(fault_of_name("e\u0301"),
            "it holds U+0301, a mark of the letter before it; type the letter with its mark as one character");
  EXPECT_EQ(fault_of_name("\u1112\u1161").substr(0, 16), "it holds U+1161,") << "Hangul, taken apart";
  EXPECT_EQ(fault_of_name("\u00e9\ud558"), "") << "the same letters, each as one character";
  EXPECT_EQ(file_name_of("a\u200bb"), "a%E2%80%8Bb");
  EXPECT_EQ(file_name_of("a\u00a0b"), "a%C2%A0b");
  EXPECT_EQ(file_name_of("e\u0301"), "e%CC%81");
}

TEST(FileNames, OfAnyTextAreNamesOfFilesAndLongOnesEndWithAHash) {
  EXPECT_EQ(file_name_of("lateral 60 degrees.v2"), "lateral 60 degrees.v2");
  EXPECT_EQ(file_name_of("a/b"), "a%2Fb");
  EXPECT_EQ(file_name_of("a_b"), "a_b");
  EXPECT_EQ(file_name_of("a\\b"), "a%5Cb");
  EXPECT_EQ(file_name_of("a%2Fb"), "a%252Fb");
  EXPECT_EQ(file_name_of(".."), "%2E.");
  EXPECT_EQ(file_name_of("."), "%2E");
  EXPECT_EQ(file_name_of(""), "%");
  EXPECT_EQ(file_name_of("%"), "%25");
  EXPECT_EQ(file_name_of("~"), "%7E");
  EXPECT_EQ(file_name_of(" a "), "%20a%20");
  EXPECT_EQ(file_name_of("\x1b[2J"), "%1B[2J");
  EXPECT_EQ(file_name_of("größer"), "größer");
  EXPECT_EQ(file_name_of("\u202e"), "%E2%80%AE");
  EXPECT_EQ(file_name_of("a\xff\x80"), "a%FF%80");
  const std::string one = file_name_of(std::string(300, 'x') + "1"), other = file_name_of(std::string(300, 'x') + "2");
  EXPECT_NE(one, other);
  EXPECT_EQ(one.size(), 200u);
  EXPECT_LE(file_name_of(std::string(1000, '/')).size(), 200u);
  std::string characters;
  for (int i = 0; i < 100; ++i) characters += "\u6f22";
  EXPECT_EQ(file_name_of(characters),
            file_name_of(file_name_of(characters)).replace(file_name_of(file_name_of(characters)).find("%7E"), 3, "~"))
      << "no character is cut in two";
}

TEST(FileNames, NoTwoTextsShareOne) {
  std::mt19937 random(1);
  std::set<std::string> texts, names;
  const std::vector<std::string> parts{"/", "\\", "%",    "_",    ".",    " ",    "~",      "2F", "2",
                                       "F", "a",  "\x1b", "\xff", "\xc3", "\xa4", "\u00e4", "\n", "\u202e"};
  for (int i = 0; i < 200000; ++i) {
    std::string text;
    for (unsigned length = random() % 6; length-- > 0;) text += parts[random() % parts.size()];
    if (!texts.insert(text).second) continue;
    const std::string name = file_name_of(text);
    EXPECT_TRUE(names.insert(name).second) << text;
    EXPECT_EQ(name.find_first_of("/\\"), std::string::npos);
    EXPECT_FALSE(name.starts_with(".") || name.empty() || name.ends_with(" ")) << name;
  }
  EXPECT_GT(texts.size(), 50000u);
}

TEST(FileNames, OfOneListAreDistinct) {
  EXPECT_EQ(marrow::distinct_names({"a", "b"}), (Texts{"a", "b"}));
  EXPECT_EQ(marrow::distinct_names({"a", "a", "b", "a"}), (Texts{"a", "a (2)", "b", "a (3)"}));
  EXPECT_EQ(marrow::distinct_names({"a", "a (2)", "a", "a (2)"}), (Texts{"a", "a (2)", "a (3)", "a (2) (2)"}));
}

namespace fs = std::filesystem;
using marrow::plain_path;
using runtime_fixture::Scratch;

TEST(PlainPath, FoldersGoWithWhatLeadsOutOfThem) {
  const Scratch scratch;
  fs::create_directories(scratch.path / "a" / "b");
  EXPECT_EQ(plain_path(scratch.path / "a/b/../../x"), scratch.path / "x");
  EXPECT_EQ(plain_path(scratch.path / "./a/.//b/./x"), scratch.path / "a/b/x");
  EXPECT_EQ(plain_path(scratch.path / "a/b/..").string(), (scratch.path / "a/").string());
  EXPECT_EQ(plain_path(scratch.path / "a/").string(), (scratch.path / "a/").string());
  EXPECT_EQ(plain_path("/../.."), "/");
  EXPECT_EQ(plain_path("/../x"), "/x");
}

TEST(PlainPath, WhatIsNoFolderStays) {
  const Scratch scratch;
  scratch.write("file", "");
  for (const char* name : {"file/../x", "missing/../x"})  // which the system does not find either
    EXPECT_EQ(plain_path(scratch.path / name), scratch.path / name);
}

TEST(PlainPath, AfterALinkThePathGoesUpFromWhereItLeads) {
  const Scratch scratch;
  fs::create_directories(scratch.path / "here");
  fs::create_directories(scratch.path / "real" / "inner" / "most");
  fs::create_directory_symlink(scratch.path / "real" / "inner", scratch.path / "here" / "link");
  for (const char* folder : {"here", "real"}) std::ofstream(scratch.path / folder / "file") << folder;
  EXPECT_EQ(plain_path(scratch.path / "here/link/../file"), scratch.path / "here/link/../file");
  EXPECT_EQ(plain_path(scratch.path / "here/link/../../x"), scratch.path / "here/link/../../x");
  EXPECT_EQ(plain_path(scratch.path / "here/link/most/../x"), scratch.path / "here/link/x");
  EXPECT_TRUE(fs::equivalent(plain_path(scratch.path / "real/../here/./link/../file"), scratch.path / "real/file"));
}

TEST(PlainPath, RelativeOnes) {
  EXPECT_EQ(plain_path(""), "");
  EXPECT_EQ(plain_path("."), ".");
  EXPECT_EQ(plain_path("../../x"), "../../x");
  EXPECT_EQ(plain_path("./x"), "x");
}

}  // namespace file_names_test
