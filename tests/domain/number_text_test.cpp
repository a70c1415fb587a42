// SPDX-License-Identifier: Apache-2.0
// Texts of numbers under any locale. What is expected is what printf gives in the "C" locale, and strtod there.
#include "marrow/base/number_text.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <cstdlib>
#include <limits>

#include "comma_locale.hpp"

namespace number_text_test {

using marrow::formatted;
using marrow::parsed_number;

TEST(NumberText, IsThatOfPrintf) {
  for (const double value : {0.0, -0.0, 1.5, -1234567.891, 1e-7, 1e300, std::nan(""), HUGE_VAL})
    for (const char* format : {"%g", "%.17g", "%f", "%.3e", "%+09.2f|"}) {
      char expected[400];
      std::snprintf(expected, sizeof expected, format, value);
      EXPECT_EQ(formatted(format, value), expected) << format;
    }
  EXPECT_EQ(formatted("{}: {} of {}", "a", 3, std::size_t(4)), "a: 3 of 4");
  EXPECT_EQ(formatted("{}", std::string(5000, 'x').c_str()), std::string(5000, 'x'));
}

TEST(NumberText, IsReadWhole) {
  for (const char* text : {"1", "-0.5", "+2e-3", "1e5", ".5", "5.", "-inf"})
    EXPECT_EQ(parsed_number(text), std::strtod(text, nullptr)) << text;
  EXPECT_TRUE(std::isnan(parsed_number("nan").value()));
  for (const char* text : {"", "+", "+-1", "1,5", "1.5 ", " 1", "1e", "0x10", "1e999", "one"})
    EXPECT_FALSE(parsed_number(text)) << text;
}

TEST(NumberText, DoesNotDependOnTheLocale) {
  MARROW_NEED_COMMA_LOCALE(german);
  EXPECT_EQ(formatted("{:.2f} {:g}", 1.5, 0.25), "1.50 0.25");
  EXPECT_EQ(parsed_number("1.5"), 1.5);
  EXPECT_FALSE(parsed_number("1,5"));
  char text[8];
  std::snprintf(text, sizeof text, "%.1f", 1.5);
  EXPECT_STREQ(text, "1,5") << "the locale of the caller stays";
}

}  // namespace number_text_test
