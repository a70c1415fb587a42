// SPDX-License-Identifier: Apache-2.0
// Texts from elsewhere: of other systems, on their way to a terminal, with brackets left open; and bytes as text. The
// bytes of UTF-16 are those of Python's encode("utf-16-le") and its like.
#include <cmath>
#include <cstdlib>
#include <limits>
#include <marrow/base/png_text.hpp>

#include "marrow/base/number_text.hpp"
#include "marrow/base/plain_text.hpp"
#include "marrow/base/printable.hpp"
#include "marrow/base/strict_yaml.hpp"
#include "tests/harness/comma_locale.hpp"
#include "tests/harness/message_of.hpp"

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

TEST(Printable, WhatCannotBeShownIsWrittenOut) {
  EXPECT_EQ(printable("a\x1b[31mred\x1b]0;title\x07"), "a\\x1b[31mred\\x1b]0;title\\x07");
  EXPECT_EQ(printable(std::string_view("\0\t\r\n\x7f", 5)), "\\x00\\x09\\x0d\\x0a\\x7f");
  EXPECT_EQ(printable("\u0080\u009b31m\u009f\u00a0"), "\\u0080\\u009b31m\\u009f\u00a0") << "C1, in UTF-8";
  EXPECT_EQ(printable("\u202egnp.exe\u202c \u2066x\u2069 \u200f \u061c \u2028"),
            "\\u202egnp.exe\\u202c \\u2066x\\u2069 \\u200f \\u061c \\u2028");
  EXPECT_EQ(printable("a\u200bb\u200dc\u2060d\ufeffe\u00adf\U000e0001"),
            "a\\u200bb\\u200dc\\u2060d\\ufeffe\\u00adf\\U000e0001");
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
  const std::string once = printable("\x1b[0m\n\xff");
  EXPECT_EQ(printable(once), once);
}

TEST(Printable, LinesAndLongTexts) {
  EXPECT_EQ(marrow::printable_lines("two\nlines\x1b\n"), "two\n  lines\\x1b\n");
  EXPECT_EQ(marrow::printable_lines("a\r\nmarrow: done"), "a\\x0d\n  marrow: done");
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

TEST(Unclosed, NamesTheInnermostMarkOutsideOfQuotesAndComments) {
  EXPECT_EQ(unclosed(""), "");
  EXPECT_EQ(unclosed("a: {b: [1, 2], c: 'x', d: \"y\"}\n"), "");
  EXPECT_EQ(unclosed("a: {b: [1, 2], c: 3\n"), "{ 1:4");
  EXPECT_EQ(unclosed("a: {b: [1, 2, c: 3\n"), "[ 1:8");
  EXPECT_EQ(unclosed("a: 1\nb:\n  - [x\n"), "[ 3:5");
  EXPECT_EQ(unclosed("a: \"x\nb: 1\n"), "\" 1:4");
  EXPECT_EQ(unclosed("a: [1, 2}\n"), "[ 1:4") << "closed by another kind";
  EXPECT_EQ(unclosed("a: {b: 1]\n"), "{ 1:4");
  EXPECT_EQ(unclosed("a: 1}\nb: 2]\n"), "") << "nothing was opened";
  EXPECT_EQ(unclosed("{a: \"x}\", b: 1"), "{ 1:1");
  EXPECT_EQ(unclosed("{a: 'x}', b: 1"), "{ 1:1");
  EXPECT_EQ(unclosed("{a: \"x'\", b: 'y\"'}"), "");
  EXPECT_EQ(unclosed("a: \"b\\\"c\""), "") << "an escaped quote";
  EXPECT_EQ(unclosed("a: \"b\\\""), "\" 1:4");
  EXPECT_EQ(unclosed("a: \"b\\\\\""), "") << "an escaped backslash";
  EXPECT_EQ(unclosed("{a: 'c:\\', b: 1"), "{ 1:1") << "in single quotes, a backslash is one";
  EXPECT_EQ(unclosed("{a: \"b\\\nc\", d: [1"), "[ 2:8");
  EXPECT_EQ(unclosed("a: the bone's end\n"), "");
  EXPECT_EQ(unclosed("a: f[1\n"), "");
  EXPECT_EQ(unclosed("a: [1,'x',{b: 2}]\n"), "");
  EXPECT_EQ(unclosed("{a: 1 # }\n"), "{ 1:1");
  EXPECT_EQ(unclosed("a: 1 # {\nb: 2\n"), "");
  EXPECT_EQ(unclosed("# [\n"), "");
  EXPECT_EQ(unclosed("[a#]"), "") << "no comment within a word";
}

// Texts in a PNG file of one pixel. The bytes and check sums are those of Python's zlib.

using namespace std::string_literals;

const std::string kBegin = "\x89PNG\r\n\x1a\n\0\0\0\x0dIHDR\0\0\0\x01\0\0\0\x01\x08\0\0\0\0\x3a\x7e\x9b\x55"s;
const std::string kRest = "\0\0\0\x0aIDATx\xda\x63\x60\x07\0\0\x09\0\x08\x8d\xab\xb9\x01\0\0\0\0IEND\xae\x42\x60\x82"s;
const std::string kText = "\0\0\0\x0ciTXtkey\0\0\0\0\0a\xc3\xa9\n\x9f\x07\x80\x0b"s;  // "aé", and the end of the line

std::string fault_of(const std::string& png, const std::string& keyword = "key") {
  return marrow::test::message_of([&] { (void)marrow::png_text(png, keyword); });
}

std::string with(std::string png, std::size_t at, char byte) {
  png.at(at) = byte;
  return png;
}

TEST(PngText, StandsAfterTheHeaderAndNothingElseChanges) {
  const std::string png = marrow::with_png_text(kBegin + kRest, "key", "aé\n");
  EXPECT_EQ(png, kBegin + kText + kRest);
  EXPECT_EQ(marrow::png_text(png, "key"), "aé\n");
  EXPECT_EQ(marrow::without_png_text(png, "key"), kBegin + kRest);
}

TEST(PngText, ReplacesTheOneOfItsKeywordOnly) {
  const std::string other = marrow::with_png_text(kBegin + kText + kRest, "ke", "other");
  EXPECT_EQ(marrow::png_text(other, "key"), "aé\n");
  EXPECT_EQ(marrow::png_text(other, "ke"), "other");
  const std::string twice = marrow::with_png_text(other, "ke", "aé\n");
  EXPECT_EQ(marrow::png_text(twice, "ke"), "aé\n");
  EXPECT_EQ(marrow::without_png_text(twice, "ke"), kBegin + kText + kRest);
  EXPECT_EQ(marrow::png_text(kBegin + kRest, "key"), std::nullopt);
  EXPECT_EQ(marrow::png_text(kBegin + kText + kRest, "keyword"), std::nullopt);
  EXPECT_EQ(marrow::png_text(kBegin + kText + kRest, "ke"), std::nullopt);
}

TEST(PngText, SaysWhatIsDamaged) {
  const std::string png = kBegin + kText + kRest;
  const std::size_t text = kBegin.size() + 8;  // the data of the chunk
  EXPECT_EQ(fault_of("GIF89a"), "it is no PNG file");
  EXPECT_EQ(fault_of(png.substr(0, png.size() - 1)), "the PNG file ends too early");
  EXPECT_EQ(fault_of(png.substr(0, text)), "the PNG file ends too early");
  EXPECT_EQ(fault_of(kBegin + "\xff\xff\xff\xffiTXtkey"), "the PNG file ends too early");
  EXPECT_EQ(fault_of(with(png, text + 8, 'b')), "the text of the PNG file was changed: its check sum is another one");
  EXPECT_EQ(fault_of(kBegin + "\0\0\0\x06iTXtkey\0\x01\0\x43\xef\x92\x0e"s + kRest),
            "another program has compressed the text of the PNG file");
  EXPECT_EQ(fault_of(kBegin + "\0\0\0\x06iTXtkey\0\0\0\x5a\xf4\xa3\x4f"s + kRest),
            "the text of the PNG file is not whole");
}

// Texts of numbers under any locale. What is expected is what printf gives in the "C" locale, and strtod there.

using namespace marrow;

constexpr double kInfinity = std::numeric_limits<double>::infinity();
constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
constexpr double kLeast = std::numeric_limits<double>::denorm_min();

std::string printed(const char* format, double value) {
  char text[400];
  std::snprintf(text, sizeof text, format, value);
  return text;
}

TEST(NumberText, IsThatOfPrintf) {
  for (const double value : {0.0, -0.0, 1.5, -1234567.891, 1e-7, 1e300, kLeast, kNan, kInfinity}) {
    EXPECT_EQ(formatted("{:g}", value), printed("%g", value));
    EXPECT_EQ(formatted("{:.17g}", value), printed("%.17g", value));
    EXPECT_EQ(formatted("{:f}", value), printed("%f", value));
    EXPECT_EQ(formatted("{:.3e}", value), printed("%.3e", value));
    EXPECT_EQ(formatted("{:+09.2f}|", value), printed("%+09.2f|", value));
  }
  EXPECT_EQ(formatted("{}: {} of {}", "a", 3, std::size_t(4)), "a: 3 of 4");
  EXPECT_EQ(formatted("{}", std::string(5000, 'x').c_str()), std::string(5000, 'x'));
}

TEST(NumberText, IsShortOrHasSoManyDecimals) {
  EXPECT_EQ(short_number(0.125), "0.125");
  EXPECT_EQ(short_number(1.5e-7), "1.5e-07");
  EXPECT_EQ(short_number(95), "95");
  EXPECT_EQ(short_number(1234.5), "1.23e+03");
  EXPECT_EQ(short_number(0.1 + 0.2, 6), "0.3");
  EXPECT_EQ(fixed_number(-0.0, 1), "0.0");
  EXPECT_EQ(fixed_number(-0.04, 1), "0.0");
  EXPECT_EQ(fixed_number(-0.06, 1), "-0.1");
  EXPECT_EQ(fixed_number(-kLeast, 2), "0.00");
  EXPECT_EQ(fixed_number(2.0 / 3, 12), "0.666666666667");
  EXPECT_EQ(fixed_number(1e300, 0).size(), 301u);
  EXPECT_EQ(fixed_number(-kInfinity, 1), "-inf");
  EXPECT_EQ(fixed_number(kNan, 1), "nan");
}

TEST(NumberText, IsExact) {
  EXPECT_EQ(exact_number(0.1 + 0.2), "0.30000000000000004");
  EXPECT_EQ(exact_number(-0.0), "-0");
  EXPECT_EQ(exact_number(100000), "100000");
  EXPECT_EQ(exact_number(999999999999999), "999999999999999");
  EXPECT_EQ(exact_number(1e15), "1e+15");
  EXPECT_EQ(exact_number(kLeast), "5e-324");
  EXPECT_EQ(exact_number(-kInfinity), "-inf");
  EXPECT_EQ(exact_number(kNan), "nan");
  EXPECT_EQ(shortest_number(100000), "1e+05");
  EXPECT_EQ(shortest_number(123456), "123456");
}

TEST(NumberText, ShowsNoShareAsNoneOrAllThatIsNeither) {
  EXPECT_EQ(percent_text(0, 1), "0.0");
  EXPECT_EQ(percent_text(1, 1), "100.0");
  EXPECT_EQ(percent_text(0.5, 0), "50");
  EXPECT_EQ(percent_text(1.0 / 3000, 1), "0.03");
  EXPECT_EQ(percent_text(0.9999, 1), "99.99");
  EXPECT_EQ(percent_text(1e-20, 1), "1.0e-18");
  EXPECT_EQ(percent_text(1 - 1e-11, 1), "99.999999999");
}

TEST(NumberText, CountsAndIsReadWhole) {
  EXPECT_EQ(counted(0, "case"), "0 cases");
  EXPECT_EQ(counted(1, "case"), "1 case");
  EXPECT_EQ(counted(1, "node was", "nodes were"), "1 node was");
  EXPECT_EQ(counted(2, "pass", "passes"), "2 passes");
  for (const char* text : {"1", "-0.5", "+2e-3", "1e5", ".5", "5.", "5e-324", "-inf"})
    EXPECT_EQ(parsed_number(text), std::strtod(text, nullptr)) << text;
  EXPECT_TRUE(std::isnan(parsed_number("nan").value()));
  for (const char* text : {"", "+", "+-1", "1,5", "1.5 ", " 1", "1e", "0x10", "1e999", "1e-999", "one"})
    EXPECT_FALSE(parsed_number(text)) << text;
}

TEST(NumberText, DoesNotDependOnTheLocale) {
  MARROW_NEED_COMMA_LOCALE(german);
  EXPECT_EQ(formatted("{:.2f} {:g}", 1.5, 0.25), "1.50 0.25");
  EXPECT_EQ(short_number(1.5) + fixed_number(1.5, 1) + exact_number(1.5) + percent_text(0.015, 1), "1.51.51.51.5");
  EXPECT_EQ(parsed_number("1.5"), 1.5);
  EXPECT_FALSE(parsed_number("1,5"));
  EXPECT_EQ(printed("%.1f", 1.5), "1,5") << "the locale of the caller stays";
}

}  // namespace texts_test
