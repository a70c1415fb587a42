// SPDX-License-Identifier: Apache-2.0
// Texts from elsewhere: of other systems, on their way to a terminal, with brackets left open; and bytes as text. The
// bytes of UTF-16 are those of Python's encode("utf-16-le") and its like.
#include <gtest/gtest.h>

#include "marrow/base/base64.hpp"
#include "marrow/base/plain_text.hpp"
#include "marrow/base/printable.hpp"
#include "marrow/base/unclosed.hpp"

namespace texts_test {

using marrow::cut;
using marrow::plain_text;
using marrow::printable;

TEST(Base64, IsThatOfRfc4648) {
  for (const auto& [bytes, text] : {std::pair("", ""),
                                    {"f", "Zg=="},
                                    {"fo", "Zm8="},
                                    {"foo", "Zm9v"},
                                    {"foob", "Zm9vYg=="},
                                    {"fooba", "Zm9vYmE="},
                                    {"foobar", "Zm9vYmFy"}})
    EXPECT_EQ(marrow::base64(bytes), text);
  EXPECT_EQ(marrow::base64(std::string("\xff\xfe\xfb\x00\x80\x3e", 6)), "//77AIA+") << "bytes are unsigned";
}

TEST(PlainText, LineEnds) {
  EXPECT_EQ(plain_text("a\nb\n"), "a\nb\n");
  EXPECT_EQ(plain_text("a\r\nb\r\n"), "a\nb\n");
  EXPECT_EQ(plain_text("a\rb\r"), "a\nb\n");
  EXPECT_EQ(plain_text("a\r\r\nb\r\n\r"), "a\nb\n");
  EXPECT_EQ(plain_text("a\r,b\nc"), "a\r,b\nc") << "beside line feeds it is no line end";
  EXPECT_EQ(plain_text(""), "");
}

TEST(PlainText, MarksAndUtf16) {
  EXPECT_EQ(plain_text("\xEF\xBB\xBFgr\xC3\xB6\xC3\x9F"
                       "er"),
            "gr\xC3\xB6\xC3\x9F"
            "er");
  EXPECT_EQ(plain_text(std::string("\xFF\xFE\xF6\0\r\0\n\0\x34\xD8\x1E\xDD", 12)), "\xC3\xB6\n\xF0\x9D\x84\x9E");
  EXPECT_EQ(plain_text(std::string("\xFE\xFF\0\xF6\0\r\xD8\x34\xDD\x1E", 10)), "\xC3\xB6\n\xF0\x9D\x84\x9E");
  EXPECT_EQ(plain_text(std::string("\xFE\xFF\xD8\x34\0a\0", 7)),
            "\xEF\xBF\xBD"
            "a\xEF\xBF\xBD")
      << "halves of characters";
  EXPECT_TRUE(marrow::begins_as_utf16("\xFF\xFE"));
  EXPECT_FALSE(marrow::begins_as_utf16("\xFF"));
}

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

}  // namespace texts_test
