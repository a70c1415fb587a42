// SPDX-License-Identifier: Apache-2.0
#include "tools/marrow/catalogue_text.cpp"

#include <gtest/gtest.h>

#include <limits>

#include "marrow/domain/yaml.hpp"

namespace {

using marrow::OptionValue;
using marrow::cli::yaml_text;

TEST(CatalogueText, NumbersHaveTenDigits) {
  EXPECT_EQ(yaml_text(OptionValue(true)), "true");
  EXPECT_EQ(yaml_text(OptionValue(std::int64_t(-12))), "-12");
  EXPECT_EQ(yaml_text(OptionValue(0.1)), "0.1");
  EXPECT_EQ(yaml_text(OptionValue(100000.0)), "100000");
  EXPECT_EQ(yaml_text(OptionValue(1e-6)), "1e-06");
  EXPECT_EQ(yaml_text(OptionValue(1.0 / 3)), "0.3333333333");
  EXPECT_EQ(yaml_text(OptionValue(-std::numeric_limits<double>::infinity())), "-.inf");
}

TEST(CatalogueText, TextsReadBack) {
  const std::pair<std::string, std::string> texts[] = {{"mean", "mean"},
                                                       {"cases/femur.yaml", "cases/femur.yaml"},
                                                       {"ä", "ä"},
                                                       {"", R"("")"},
                                                       {"two words", R"("two words")"},
                                                       {"true", R"("true")"},
                                                       {"~", R"("~")"},
                                                       {"a: \"b\\\"", R"("a: \"b\\\"")"},
                                                       {"a\nb", R"("a\nb")"},
                                                       {"#x", R"("#x")"},
                                                       {"- x", R"("- x")"}};
  for (const auto& [text, written] : texts) {
    EXPECT_EQ(yaml_text(OptionValue(text)), written);
    EXPECT_EQ(marrow::parse_yaml(written).Scalar(), text);
  }
}

TEST(CatalogueText, ListsAreInOneLine) {
  EXPECT_EQ(yaml_text(OptionValue(std::vector<double>{})), "[]");
  EXPECT_EQ(yaml_text(OptionValue(std::vector<double>{1, -0.5, 1e7})), "[1, -0.5, 10000000]");
  EXPECT_EQ(yaml_text(OptionValue(std::vector<std::string>{"a", "b, c", ""})), R"([a, "b, c", ""])");
}

}  // namespace
