// SPDX-License-Identifier: Apache-2.0
// Texts from files on their way to a terminal.
#include "marrow/base/printable.hpp"

#include <gtest/gtest.h>

namespace printable_test {

using marrow::cut;
using marrow::printable;

TEST(Printable, OrdinaryTextsStayAsTheyAre) {
  for (const char* text :
       {"", "a b.c-d_e", "Oberschenkel, links: größer", "\u6f22\u5b57", "\U0001F9B4", "C:\\x1b", "%41~"})
    EXPECT_EQ(printable(text), text);
}

TEST(Printable, ControlCharactersAreWrittenOut) {
  EXPECT_EQ(printable("a\x1b[31mred\x1b]0;title\x07"), "a\\x1b[31mred\\x1b]0;title\\x07");
  EXPECT_EQ(printable(std::string_view("\0\t\r\n\x7f", 5)), "\\x00\\x09\\x0d\\x0a\\x7f");
  EXPECT_EQ(printable("\u0080\u009b31m\u009f\u00a0"), "\\u0080\\u009b31m\\u009f\u00a0") << "C1, in UTF-8";
  EXPECT_EQ(printable("\u202egnp.exe\u202c \u2066x\u2069 \u200f \u061c \u2028"),
            "\\u202egnp.exe\\u202c \\u2066x\\u2069 \\u200f \\u061c \\u2028");
}

TEST(Printable, WhatIsNotDrawnIsWrittenOut) {
  EXPECT_EQ(printable("a\u200bb\u200dc\u2060d\ufeffe\u00adf\U000e0001"),
            "a\\u200bb\\u200dc\\u2060d\\ufeffe\\u00adf\\U000e0001");
}

TEST(Printable, BytesThatAreNoUtf8AreWrittenOut) {
  EXPECT_EQ(printable("\x9b"
                      "31m"),
            "\\x9b31m")
      << "C1, as terminals of 8 bits read it";
  EXPECT_EQ(printable("\xc3"), "\\xc3");
  EXPECT_EQ(printable("\xc0\x9b"), "\\xc0\\x9b") << "overlong";
  EXPECT_EQ(printable("\xe0\x82\x9b"), "\\xe0\\x82\\x9b");
  EXPECT_EQ(printable("\xed\xa0\x80"), "\\xed\\xa0\\x80") << "half a surrogate pair";
  EXPECT_EQ(printable("\xf4\x90\x80\x80"), "\\xf4\\x90\\x80\\x80") << "above the last character";
  EXPECT_EQ(printable("\xed\xbf\xbf"), "\\xed\\xbf\\xbf") << "the last half of a pair";
  EXPECT_EQ(printable("\xed\x9f\xbf\xee\x80\x80\xf4\x8f\xbf\xbf"), "\xed\x9f\xbf\xee\x80\x80\xf4\x8f\xbf\xbf")
      << "beside them";
  EXPECT_EQ(printable("\xf0\x9f\xa6x"), "\\xf0\\x9f\\xa6x");
}

TEST(Printable, OnceIsEnough) {
  const std::string once = printable("\x1b[0m\n\xff");
  EXPECT_EQ(printable(once), once);
}

TEST(Printable, LinesOfATextDoNotPassForOthers) {
  EXPECT_EQ(marrow::printable_lines("two\nlines\x1b\n"), "two\n  lines\\x1b\n");
  EXPECT_EQ(marrow::printable_lines("a\r\nmarrow: done"), "a\\x0d\n  marrow: done");
}

TEST(Printable, LongTextsAreCutBetweenCharacters) {
  EXPECT_EQ(cut("abcdef", 6), "abcdef");
  EXPECT_EQ(cut("abcdefg", 6), "abc\u2026");
  EXPECT_EQ(cut("a\u6f22\u6f22\u6f22", 9), "a\u6f22\u2026");
  EXPECT_EQ(cut(std::string(1000, 'a')).size(), 80u);
  EXPECT_EQ(marrow::in_quotes("a"), "'a'");
}

}  // namespace printable_test
