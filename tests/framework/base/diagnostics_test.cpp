// SPDX-License-Identifier: Apache-2.0
// How faults are shown, however many and however long.
#include "marrow/base/diagnostics.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <ctime>

#include "marrow/runtime/node/abi.hpp"

namespace diagnostics_test {

using marrow::Diagnostics;

std::string shown(const std::string& source, int column) {
  Diagnostics diagnostics;
  diagnostics.remember("f", source);
  diagnostics.add({"f", 1, column}, "wrong");
  return diagnostics.text();
}

TEST(Diagnostics, ControlCharactersAreWrittenOut) {
  Diagnostics diagnostics;
  diagnostics.remember("\x1b[2Jf", "a: \x1b]0;owned\x07");
  diagnostics.add({"\x1b[2Jf", 1, 1}, "unknown key '\x1b[31m'\nf:1:1: error: forged", "did you mean '\u202e'?");
  EXPECT_EQ(diagnostics.text(),
            "\\x1b[2Jf:1:1: error: unknown key '\\x1b[31m'\n  f:1:1: error: forged\n  a: \\x1b]0;owned\\x07\n  ^\n  "
            "hint: did you mean '\\u202e'?\n");
}

TEST(Diagnostics, CaretStandsBelowTheColumnAndLongLinesAreCutAroundIt) {
  EXPECT_EQ(shown("a: b", 4), "f:1:4: error: wrong\n  a: b\n     ^\n");
  EXPECT_EQ(shown("\ta: b\r\n", 5), "f:1:5: error: wrong\n   a: b\n      ^\n") << "a tab is one column";
  EXPECT_EQ(shown("größer: x", 11), "f:1:11: error: wrong\n  größer: x\n          ^\n") << "columns count bytes";
  EXPECT_EQ(shown("\x1b: x", 4), "f:1:4: error: wrong\n  \\x1b: x\n        ^\n");
  EXPECT_EQ(shown("a", 99), "f:1:99: error: wrong\n  a\n   ^\n");
  const std::string line = std::string(5000, 'a') + "HERE" + std::string(5000, 'b'), text = shown(line, 5001);
  const std::size_t begin = text.find('\n') + 1, end = text.find('\n', begin), caret = text.find('^');
  const std::string quoted = text.substr(begin, end - begin);
  EXPECT_LT(quoted.size(), 220u);
  EXPECT_EQ(quoted, "  \u2026" + std::string(100, 'a') + "HERE" + std::string(96, 'b') + "\u2026");
  EXPECT_EQ(caret - end - 1, 2u + 1 + 100) << "the ellipsis takes one column";
  EXPECT_EQ(shown(std::string(300, 'a'), 1), "f:1:1: error: wrong\n  " + std::string(200, 'a') + "\u2026\n  ^\n");
}

TEST(Diagnostics, ManyAreCountedSomeShown) {
  Diagnostics diagnostics;
  for (int i = 1; i <= 400000; ++i) diagnostics.add({"f", i, 1}, "fault " + std::to_string(i));
  EXPECT_EQ(diagnostics.size(), 400000u);
  EXPECT_EQ(diagnostics.sorted().size(), 1000u);
  EXPECT_TRUE(diagnostics.is_full());
  const std::string text = diagnostics.text();
  EXPECT_EQ(std::count(text.begin(), text.end(), '\n'), 51);
  EXPECT_NE(text.find("f:50:1: error: fault 50\nand 399950 more faults\n"), std::string::npos) << text;
  Diagnostics all;
  all.add_all(diagnostics);
  all.add_all(diagnostics);
  EXPECT_EQ(all.sorted().size(), 1000u);
}

TEST(Diagnostics, MessagesAreCutAndThoseOfAnotherCollectionAddedOnce) {
  Diagnostics one, other;
  one.add({"f", 1, 1}, "a");
  other.add({"f", 1, 1}, "a");
  other.add({"f", 1, 1}, "b");
  other.add({"f", 1, 1}, "b");
  one.add_all(other);
  EXPECT_EQ(one.size(), 2u) << one.text();
  Diagnostics diagnostics;
  diagnostics.add({"f", 1, 1}, std::string(1000000, 'x'), std::string(1000000, 'y'));
  EXPECT_LT(diagnostics.text().size(), 2100u);
}

TEST(Suggestion, NearNamesAlone) {
  EXPECT_EQ(marrow::suggestion("vlaue", {"count", "value", "flag"}), "did you mean 'value'?")
      << "two neighbours swapped";
  for (const std::vector<std::string>& known : {std::vector<std::string>{"read", "eradxy"}, {"eradxy", "read"}})
    EXPECT_EQ(marrow::nearest_name("erad", known), "read") << "the first two are swapped";
  EXPECT_EQ(marrow::nearest_name("kitten", {"sitting", "kitchen"}), "kitchen");
  EXPECT_EQ(marrow::nearest_name("abcdef", {"uvwxyz"}), "");
  EXPECT_EQ(marrow::suggestion("abcdef", {}), "there are none");
  EXPECT_EQ(marrow::suggestion("abcdef", {std::string(1000, 'x')}).size(), std::string("known: ").size() + 80);
}

TEST(Suggestion, LongAndManyNamesTakeNoTime) {
  const std::clock_t start = std::clock();
  const std::string wrong(100000, 'a');
  EXPECT_EQ(marrow::nearest_name(wrong, std::vector<std::string>(100, std::string(100000, 'b'))), "");
  std::vector<std::string> known;
  for (int i = 0; i < 2000; ++i) known.push_back("node_" + std::to_string(10000 + i));
  for (int i = 0; i < 200; ++i) EXPECT_TRUE(marrow::nearest_name("other_" + std::to_string(10000 + i), known).empty());
  EXPECT_LT(double(std::clock() - start) / CLOCKS_PER_SEC, marrow::abi_stamp().sanitizers ? 60 : 20);
}

}  // namespace diagnostics_test
