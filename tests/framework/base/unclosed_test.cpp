// SPDX-License-Identifier: Apache-2.0
#include "marrow/base/unclosed.hpp"

#include <gtest/gtest.h>

namespace unclosed_test {

/// As "mark line:column"; "" where all is closed.
std::string unclosed(const std::string& text) {
  const auto found = marrow::last_unclosed(text);
  return found ? std::string(1, found->mark) + " " + std::to_string(found->line) + ":" + std::to_string(found->column)
               : "";
}

TEST(Unclosed, NamesTheInnermostMark) {
  EXPECT_EQ(unclosed(""), "");
  EXPECT_EQ(unclosed("a: {b: [1, 2], c: 'x', d: \"y\"}\n"), "");
  EXPECT_EQ(unclosed("a: {b: [1, 2], c: 3\n"), "{ 1:4");
  EXPECT_EQ(unclosed("a: {b: [1, 2, c: 3\n"), "[ 1:8");
  EXPECT_EQ(unclosed("a: 1\nb:\n  - [x\n"), "[ 3:5");
  EXPECT_EQ(unclosed("a: \"x\nb: 1\n"), "\" 1:4");
  EXPECT_EQ(unclosed("a: [1, 2}\n"), "[ 1:4") << "closed by another kind";
  EXPECT_EQ(unclosed("a: {b: 1]\n"), "{ 1:4");
  EXPECT_EQ(unclosed("a: 1}\nb: 2]\n"), "") << "nothing was opened";
}

TEST(Unclosed, QuotesHideBrackets) {
  EXPECT_EQ(unclosed("{a: \"x}\", b: 1"), "{ 1:1");
  EXPECT_EQ(unclosed("{a: 'x}', b: 1"), "{ 1:1");
  EXPECT_EQ(unclosed("{a: \"x'\", b: 'y\"'}"), "");
  EXPECT_EQ(unclosed("a: \"b\\\"c\""), "") << "an escaped quote";
  EXPECT_EQ(unclosed("a: \"b\\\""), "\" 1:4");
  EXPECT_EQ(unclosed("a: \"b\\\\\""), "") << "an escaped backslash";
  EXPECT_EQ(unclosed("{a: 'c:\\', b: 1"), "{ 1:1") << "in single quotes, a backslash is one";
  EXPECT_EQ(unclosed("{a: \"b\\\nc\", d: [1"), "[ 2:8");
}

TEST(Unclosed, WordsAndCommentsAreText) {
  EXPECT_EQ(unclosed("a: the bone's end\n"), "");
  EXPECT_EQ(unclosed("a: f[1\n"), "");
  EXPECT_EQ(unclosed("a: [1,'x',{b: 2}]\n"), "");
  EXPECT_EQ(unclosed("{a: 1 # }\n"), "{ 1:1");
  EXPECT_EQ(unclosed("a: 1 # {\nb: 2\n"), "");
  EXPECT_EQ(unclosed("# [\n"), "");
  EXPECT_EQ(unclosed("[a#]"), "") << "no comment within a word";
}

}  // namespace unclosed_test
