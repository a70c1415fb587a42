// SPDX-License-Identifier: Apache-2.0
// How the tables of a comparison write numbers, shares and columns. The texts follow from the values by hand.
#include "compare/text_table.hpp"

#include <gtest/gtest.h>

#include <cmath>

#include "marrow/base/number_text.hpp"

namespace {

using marrow::percent_text;
using marrow::cli::NumberScale;
using marrow::cli::Side;
using marrow::cli::TextTable;

TEST(FigureText, UsualNumbersHaveFourDecimals) {
  const NumberScale scale({0.5, 31.25, 0});
  EXPECT_EQ(scale.text(31.25), "31.2500");
  EXPECT_EQ(scale.text(0.5), "0.5000");
  EXPECT_EQ(scale.text(-0.0), "0.0000");
  EXPECT_EQ(NumberScale({}).text(0), "0.0000");
}

TEST(FigureText, NoNumberReadsAsZero) {
  EXPECT_EQ(NumberScale({3e-5, 4e-5}).text(3e-5), "0.00003000");
  EXPECT_EQ(NumberScale({1e-300}).text(1e-300), "1.000e-300");
  const NumberScale scale({1e-7, 2000});
  EXPECT_EQ(scale.text(2000), "2000.00000");
  EXPECT_EQ(scale.text(1e-7), "1.000e-07");
  EXPECT_EQ(scale.text(-1e-7), "-1.000e-07");
}

TEST(FigureText, LargeNumbersHaveAnExponent) {
  EXPECT_EQ(NumberScale({123456.7}).text(123456.7), "123457");
  EXPECT_EQ(NumberScale({1e7}).text(1e7), "1.000e+07");
  EXPECT_EQ(NumberScale({1e300, 0}).text(0), "0");
}

TEST(FigureText, NoShareReadsAsNoneOrAll) {
  EXPECT_EQ(percent_text(0, 1), "0.0");
  EXPECT_EQ(percent_text(1, 0), "100");
  EXPECT_EQ(percent_text(0.5, 1), "50.0");
  EXPECT_EQ(percent_text(1.0 / 301, 0), "0.3");
  EXPECT_EQ(percent_text(300.0 / 301, 0), "99.7");
  EXPECT_EQ(percent_text(1.0 / 3000, 1), "0.03");
  EXPECT_EQ(percent_text(2999.0 / 3000, 1), "99.97");
  EXPECT_EQ(percent_text(1e-20, 1), "1.0e-18");
  EXPECT_EQ(percent_text(std::nextafter(1.0, 0.0), 1), "99.99999999999999");
}

TEST(FigureText, ARateOfNothingIsNone) {
  EXPECT_EQ(marrow::cli::rate_text(0, 0, {0, 1}, 1), "-");
  EXPECT_EQ(marrow::cli::rate_text(1, 301, {0.0005, 0.0186}, 1), "1/301 (0.1 to 1.9 %)");
  EXPECT_EQ(marrow::cli::rate_text(1, 301, {0.0004, 0.0186}, 0), "1/301 (0.04 to 2 %)");
}

TEST(FigureText, ColumnsAreAsWideAsTheirTexts) {
  TextTable table({Side::left, Side::right, Side::left});
  table.add({"name", "number", "more"});
  table.add({"\xC3\xA9t\xC3\xA9", "12345678901234567890", "x"});  // three characters, five bytes
  table.add({"a\nb", "1"});
  EXPECT_EQ(table.text(),
            "name                  number  more\n"
            "\xC3\xA9t\xC3\xA9     12345678901234567890  x\n"
            "a\\x0ab                     1\n");
}

}  // namespace
