// SPDX-License-Identifier: Apache-2.0
// JSON that nobody vouches for.
#include "marrow/base/json_text.hpp"

#include <gtest/gtest.h>

#include "tests/harness/message_of.hpp"

namespace json_text_test {

using marrow::test::message_of;

std::string fault_in(const std::string& text) {
  return message_of([&] { marrow::parse_json(text, "a.json"); });
}

std::string nested(int levels) { return std::string(std::size_t(levels), '[') + std::string(std::size_t(levels), ']'); }

TEST(JsonText, DeepNestingIsRefused) {
  EXPECT_EQ(fault_in(nested(64)), "");
  EXPECT_EQ(fault_in(nested(65)), "a.json: lists and objects are nested more than 64 deep");
  EXPECT_NE(fault_in(nested(1000000)).find("nested"), std::string::npos);
  std::string objects;
  for (int i = 0; i < 100000; ++i) objects += "{\"a\":";
  EXPECT_NE(fault_in(objects).find("nested"), std::string::npos);
}

TEST(JsonText, BracketsInTextsAreNoNesting) {
  EXPECT_EQ(fault_in("[\"" + std::string(100, '[') + "\\\"" + std::string(100, '{') + "\\\\\", [1]]"), "");
}

TEST(JsonText, FaultsNameTheirPlace) {
  EXPECT_EQ(fault_in(""), "a.json:1:1: not valid JSON");
  EXPECT_EQ(fault_in("{\"a\": 1,\n \"b\": x}"), "a.json:2:7: not valid JSON");
  EXPECT_EQ(fault_in("[1, 1e999]"), "a.json: not valid JSON: a number in it is too large");
  EXPECT_NE(fault_in("[\"\xff\"]").find("not valid JSON"), std::string::npos) << "no text in UTF-8";
}

TEST(JsonText, WholeNumbersWithinBounds) {
  const auto fault = [](const char* text) {
    return message_of([&] { marrow::integer_of(marrow::parse_json(text, ""), 1, 1024, "'threads'"); });
  };
  EXPECT_EQ(fault("1"), "");
  EXPECT_EQ(fault("1024"), "");
  EXPECT_EQ(fault("1000000000"), "'threads' is 1000000000; expected a whole number from 1 to 1024");
  EXPECT_EQ(fault("18446744073709551615"), "'threads' is 18446744073709551615; expected a whole number from 1 to 1024");
  for (const char* text : {"0", "-1", "1.5", "1e3", "\"2\"", "null", "true", "[1]"})
    EXPECT_NE(fault(text).find("expected a whole number"), std::string::npos) << text;
}

}  // namespace json_text_test
