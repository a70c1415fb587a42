// SPDX-License-Identifier: Apache-2.0
// Texts of numbers under any locale. What is expected is what printf gives in the "C" locale, and strtod there.
#include "marrow/base/number_text.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <limits>

#include "tests/harness/comma_locale.hpp"

namespace number_text_test {

using marrow::counted;
using marrow::exact_number;
using marrow::fixed_number;
using marrow::formatted;
using marrow::parsed_number;
using marrow::percent_text;
using marrow::short_number;
using marrow::shortest_number;

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

TEST(NumberText, IsShort) {
  EXPECT_EQ(short_number(0.125), "0.125");
  EXPECT_EQ(short_number(1.5e-7), "1.5e-07");
  EXPECT_EQ(short_number(95), "95");
  EXPECT_EQ(short_number(1234.5), "1.23e+03");
  EXPECT_EQ(short_number(0.1 + 0.2, 6), "0.3");
}

TEST(NumberText, HasSoManyDecimalsAndNoMinusBeforeZero) {
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

TEST(NumberText, Counts) {
  EXPECT_EQ(counted(0, "case"), "0 cases");
  EXPECT_EQ(counted(1, "case"), "1 case");
  EXPECT_EQ(counted(1, "node was", "nodes were"), "1 node was");
  EXPECT_EQ(counted(2, "pass", "passes"), "2 passes");
}

TEST(NumberText, IsReadWhole) {
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

}  // namespace number_text_test
