// SPDX-License-Identifier: Apache-2.0
// The rules by which all YAML is read.
#include "marrow/base/yaml.hpp"

#include "marrow/base/json_text.hpp"
#include "tests/harness/message_of.hpp"

namespace yaml_test {

using marrow::parse_yaml;

YAML::Node scalar(const std::string& text) { return parse_yaml("k: " + text)["k"]; }

std::string refusal(const std::string& text, const marrow::YamlLimits& limits = {}) {
  try {
    parse_yaml(text, limits);
  } catch (const YAML::Exception& error) {
    return std::to_string(error.mark.line + 1) + ": " + error.msg;
  }
  return "";
}

TEST(Yaml, NumbersAndTruthValues) {
  EXPECT_EQ(marrow::yaml_number(scalar("+1.5e2")), 150);
  EXPECT_EQ(marrow::yaml_number(scalar("-0.25")), -0.25);
  EXPECT_EQ(marrow::yaml_number(scalar("010")), 10);
  for (const char* text : {"0x10", ".inf", ".nan", "nan", "1e999", "1,5", "'1'", "one", "[1]", "~"})
    EXPECT_EQ(marrow::yaml_number(scalar(text)), std::nullopt) << text;
  EXPECT_EQ(marrow::yaml_integer(scalar("10")), 10);
  EXPECT_EQ(marrow::yaml_integer(scalar("-9223372036854775808")), INT64_MIN);
  EXPECT_EQ(marrow::yaml_integer(scalar("0")), 0);
  for (const char* text : {"010", "-07", "9223372036854775808", "1.0", "\"1\"", "0x1"})
    EXPECT_EQ(marrow::yaml_integer(scalar(text)), std::nullopt) << text;
  EXPECT_TRUE(marrow::has_leading_zeros(scalar("010")));
  EXPECT_FALSE(marrow::has_leading_zeros(scalar("0.5")));
  EXPECT_FALSE(marrow::has_leading_zeros(scalar("0")));
  EXPECT_EQ(marrow::yaml_boolean(scalar("true")), true);
  EXPECT_EQ(marrow::yaml_boolean(scalar("false")), false);
  for (const char* text : {"yes", "True", "on", "1", "'true'"})
    EXPECT_EQ(marrow::yaml_boolean(scalar(text)), std::nullopt) << text;
}

TEST(Yaml, WhatIsSaidOfAValue) {
  EXPECT_EQ(marrow::yaml_described(scalar("word")), "'word'");
  EXPECT_EQ(marrow::yaml_described(scalar("'6'")), "the quoted text \"6\"");
  EXPECT_EQ(marrow::yaml_described(scalar("[1, 2]")), "a list of 2");
  EXPECT_EQ(marrow::yaml_described(scalar("{a: 1}")), "a map");
  EXPECT_EQ(marrow::yaml_described(scalar("")), "nothing");
}

TEST(Yaml, KeysStandOnceAndAreNames) {
  std::vector<marrow::YamlFault> faults;
  const auto keys = marrow::yaml_keys(parse_yaml("a: 1\n<<: {x: 1}\na: 2\n[1]: 3\n\"b\\e\": 4\nc: 5\n"), "it", faults);
  ASSERT_EQ(keys.size(), 2u);
  EXPECT_EQ(keys[0].value.Scalar() + keys[1].name, "1c");
  std::string said;
  for (const auto& fault : faults) said += std::to_string(fault.mark.line + 1) + ": " + fault.text + "; ";
  EXPECT_EQ(
      said,
      "2: merge keys (<<) are not supported; 3: 'a' is given twice in it; 4: a key in it must be a name, got a list "
      "of 1; 5: the key 'b\x1b' in it holds a control character; ");
}

TEST(Yaml, TabsThatIndentAreNamed) {
  const std::string said = "a tab indents this line; write spaces instead";
  EXPECT_EQ(refusal("a:\n\tb: 1\n"), "2: " + said);
  EXPECT_EQ(refusal("a:\n\t- 1\n"), "2: " + said);
  EXPECT_EQ(refusal("a:\n  b: 1\n  \tc: 1\n"), "3: " + said);
  EXPECT_EQ(refusal("a: |\n\ttext\n"), "2: " + said);
  EXPECT_EQ(refusal("\ta: 1\nb: 1\n"), "1: " + said);
  EXPECT_EQ(refusal("a:\t1\nb: [1,\n\t2]\n"), "") << "tabs elsewhere do no harm";
  EXPECT_EQ(refusal("a:\t1\nb: [1\n").find("tab"), std::string::npos) << "the fault is another";
}

/// YAML would read "b" and 5 without a word.
TEST(Yaml, TagsAndAnchorsThatNobodyNamesAreRefused) {
  const std::string tag = "tags (! or !!name) are not read; put quotes around a text that begins so",
                    anchor =
                        "this begins with an anchor (&name) that no alias (*name) names; put quotes around a text that "
                        "begins so";
  for (const char* text : {"a: ! b\n", "a: !!str 5\n", "a: !mine b\n", "a: ! 'b'\n", "a: !!map {}\n", "a: !!seq []\n",
                           "! a: b\n", "[\"é\", ! b]\n"})
    EXPECT_EQ(refusal(text), "1: " + tag) << text;
  for (const char* text : {"a: &a b\n", "a: &a {}\n", "&a a: b\n", "[&a b, &a c, *a]\n"})
    EXPECT_EQ(refusal(text), "1: " + anchor) << text;
  for (const char* text : {"a: '! b'\n", "a: \"&a b\"\n", "a: b ! c & d\n", "a: &a b\nc: *a\n", "a: |\n  ! b\n"})
    EXPECT_EQ(refusal(text), "") << text;
}

TEST(Yaml, KeysThatLookTheSameAreRefused) {
  std::vector<marrow::YamlFault> faults;
  marrow::yaml_keys(parse_yaml("\"a\\u200b\": 1\n\"a\\u00a0b\": 1\n\"e\\u0301\": 1\né: 1\n"), "it", faults);
  ASSERT_EQ(faults.size(), 3u);
  EXPECT_EQ(faults[0].text, "the key 'a\u200b' in it holds U+200B, which cannot be seen");
  EXPECT_EQ(faults[1].text, "the key 'a\u00a0b' in it holds U+00A0, a blank that is not a space");
  EXPECT_EQ(
      faults[2].text,
      "the key 'e\u0301' in it holds U+0301, a mark of the letter before it; type the letter with its mark as one "
      "character");
}

TEST(Yaml, Limits) {
  EXPECT_EQ(parse_yaml("").Type(), YAML::NodeType::Null);
  EXPECT_EQ(refusal("a: &x 1\nb: *x\n"), "");
  EXPECT_EQ(refusal("a: &x 1\nb: *x\n", {false, 100}),
            "1: anchors and aliases (&name, *name) are not read; write the value out");
  EXPECT_EQ(refusal("[1, 2, 3]", {true, 3}), "1: it has more than 3 values");
  EXPECT_EQ(refusal("[1, 2]", {true, 3}), "");
  const auto nested = [](std::size_t levels, const std::string& inner) {
    return std::string(levels, '[') + inner + std::string(levels, ']');
  };
  EXPECT_EQ(refusal(nested(100, "")), "");
  EXPECT_EQ(refusal(nested(101, "")), "1: lists and maps are nested more than 100 deep");
  const std::string sixty = "a: &sixty " + nested(60, "") + "\nb: ";  // in a map, which is one level more
  EXPECT_EQ(refusal(sixty + nested(39, "*sixty")), "");
  EXPECT_EQ(refusal(sixty + nested(40, "*sixty")), "2: lists and maps are nested more than 100 deep");
  EXPECT_EQ(refusal("a: 1\n---\nb: 2\n"),
            "2: the file goes on after the end of its first document; keep one document per file");
  EXPECT_EQ(refusal("a: \"\\0\"\n"), "1: a text holds the character NUL (\\0); take it out");
}

// JSON that nobody vouches for.

using marrow::test::message_of;

std::string fault_in(const std::string& text) { return MESSAGE_OF(marrow::parse_json(text, "a.json")); }

std::string nested(int levels) { return std::string(std::size_t(levels), '[') + std::string(std::size_t(levels), ']'); }

TEST(JsonText, DeepNestingIsRefused) {
  EXPECT_EQ(fault_in(nested(64)), "");
  EXPECT_EQ(fault_in(nested(65)), "a.json: lists and objects are nested more than 64 deep");
  EXPECT_HAS(fault_in(nested(1000000)), "nested");
  std::string objects;
  for (int i = 0; i < 100000; ++i) objects += "{\"a\":";
  EXPECT_HAS(fault_in(objects), "nested");
  EXPECT_EQ(fault_in("[\"" + std::string(100, '[') + "\\\"" + std::string(100, '{') + "\\\\\", [1]]"), "");
}

TEST(JsonText, FaultsNameTheirPlace) {
  EXPECT_EQ(fault_in(""), "a.json:1:1: not valid JSON");
  EXPECT_EQ(fault_in("{\"a\": 1,\n \"b\": x}"), "a.json:2:7: not valid JSON");
  EXPECT_EQ(fault_in("[1, 1e999]"), "a.json: not valid JSON: a number in it is too large");
  EXPECT_HAS(fault_in("[\"\xff\"]"), "not valid JSON") << "no text in UTF-8";
}

TEST(JsonText, WholeNumbersWithinBounds) {
  const auto fault = [](const char* text) {
    return MESSAGE_OF(marrow::integer_of(marrow::parse_json(text, ""), 1, 1024, "'threads'"));
  };
  EXPECT_EQ(fault("1"), "");
  EXPECT_EQ(fault("1024"), "");
  EXPECT_EQ(fault("1000000000"), "'threads' is 1000000000; expected a whole number from 1 to 1024");
  EXPECT_EQ(fault("18446744073709551615"), "'threads' is 18446744073709551615; expected a whole number from 1 to 1024");
  for (const char* text : {"0", "-1", "1.5", "1e3", "\"2\"", "null", "true", "[1]"})
    EXPECT_HAS(fault(text), "expected a whole number") << text;
}

}  // namespace yaml_test
