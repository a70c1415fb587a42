// SPDX-License-Identifier: Apache-2.0
#include "catalogue_text.hpp"

#include <gtest/gtest.h>

#include <limits>
#include <nlohmann/json.hpp>

#include "marrow/base/yaml.hpp"
#include "marrow/runtime/node/attributes.hpp"

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

TEST(CatalogueText, RelationsInWords) {
  using marrow::cli::relation_text;
  EXPECT_EQ(relation_text(marrow::not_above("low", "high")), "'low' is not above 'high'");
  EXPECT_EQ(relation_text(marrow::below("a", "b")), "'a' is below 'b'");
  EXPECT_EQ(relation_text(marrow::same_length({"a", "b", "c"})), "'a', 'b', 'c' have the same length");
  EXPECT_EQ(relation_text(marrow::as_many_or_none("a", "b")), "'a' has as many items as 'b', or none");
  EXPECT_EQ(relation_text(marrow::exactly_one({"a", "in.b"})), "exactly one of 'a', 'in.b' is given");
  EXPECT_EQ(relation_text(marrow::at_least_one({"a", "b"})), "at least one of 'a', 'b' is given");
  EXPECT_EQ(relation_text(marrow::at_least_one({"a"})), "'a' is not empty");
  EXPECT_EQ(relation_text(marrow::distinct("a")), "'a' has no item twice");
}

TEST(CatalogueText, AKindWithItsLimits) {
  marrow::KindInfo kind;
  kind.name = "edges";
  kind.checks = {{"bias", "how far off", 0.25, "px"}, {"contract", "what it gives", 0, ""}};
  kind.traits = {{"steady", "does not move"}};
  kind.outputs = {{"edges", "the edges", {{"edge_map", {}}}, "view"}};
  const nlohmann::json j = marrow::cli::kind_json(kind);
  EXPECT_EQ(j["checks"][0]["limit"], 0.25);
  EXPECT_FALSE(j["checks"][1].contains("limit"));
  EXPECT_EQ(j["traits"][0]["name"], "steady");
  EXPECT_EQ(j["outputs"][0]["types"][0], "edge_map");
  EXPECT_EQ(j["outputs"][0]["axis"], "view");
}

}  // namespace
