// SPDX-License-Identifier: Apache-2.0
// What is wrong with a declaration is found when the plugin registers.
#include <gtest/gtest.h>

#include <limits>
#include <set>

#include "marrow/plugin.hpp"

namespace declaration_test {

using marrow::List;
using marrow::Metrics;
using marrow::Plugin;

struct Options {
  double size_mm = 1;
  std::string word = "a";
};
Metrics plain(const Metrics&, const Options&) { return {}; }
List<Metrics> listed(const List<Metrics>&) { return {}; }
std::tuple<Metrics, marrow::Pose> two() { return {}; }
Metrics sees(const marrow::Truth&) { return {}; }
marrow::EdgeMap edges(const marrow::View&) { return {}; }
int nothing_registered() { return 1; }

std::string faults(const Plugin& plugin) {
  std::string text;
  for (const std::string& fault : plugin.nodes.back().faults) text += fault + "\n";
  return text;
}

TEST(Declaration, GoodOneHasNoFaults) {
  Plugin plugin;
  plugin.node("test.plain", plain)
      .summary("s")
      .in("a", "h")
      .out("b", "h")
      .option("size_mm", &Options::size_mm, "h", marrow::at_least(0));
  EXPECT_EQ(faults(plugin), "");
  const marrow::NodeInfo& info = plugin.nodes.back().info;
  EXPECT_EQ(info.options[0].unit, "mm") << "read off the name";
  EXPECT_EQ(info.inputs[0].type.id, "metrics");
  EXPECT_EQ(info.kind(), "test");
}
TEST(Declaration, TooFewInputs) {
  Plugin plugin;
  plugin.node("test.plain", plain).summary("s").out("b", "h");
  EXPECT_NE(faults(plugin).find("the function takes 1 inputs, but .in() names 0"), std::string::npos);
}
TEST(Declaration, ListWithoutAxis) {
  Plugin plugin;
  plugin.node("test.listed", listed).summary("s").in("a", "h").out("b", "h");
  EXPECT_NE(faults(plugin).find("input 'a': a List needs over(\"axis\")"), std::string::npos);
  EXPECT_NE(faults(plugin).find("output 'b': a List needs over(\"axis\")"), std::string::npos);
}
TEST(Declaration, NoSummaryNoOutputBadName) {
  Plugin plugin;
  plugin.node("Plain", plain).in("a", "h");
  EXPECT_NE(faults(plugin).find("has no summary"), std::string::npos);
  EXPECT_NE(faults(plugin).find("has no output"), std::string::npos);
  EXPECT_NE(faults(plugin).find("a node's name is kind.name in lower_case"), std::string::npos);
}
TEST(Declaration, DefaultNotAmongChoices) {
  Plugin plugin;
  plugin.node("test.plain", plain)
      .summary("s")
      .in("a", "h")
      .out("b", "h")
      .option("word", &Options::word, "h", marrow::one_of({"x", "y"}));
  EXPECT_NE(faults(plugin).find("option 'word': its default 'a' is not one of its choices"), std::string::npos);
}
TEST(Declaration, ReplacesWhatNoFunctionBrings) {
  Plugin plugin;
  plugin.node("test.plain", plain)
      .summary("s")
      .in("a", "h")
      .out("b", "h")
      .option("size_mm", &Options::size_mm, "h", marrow::replaces({"size_mm", "a.size_mm", "Size"}));
  EXPECT_EQ(faults(plugin).find("replaces 'size_mm'"), std::string::npos);
  EXPECT_NE(faults(plugin).find("option 'size_mm' replaces 'a.size_mm': there is no input 'a' that takes functions"),
            std::string::npos);
  EXPECT_NE(faults(plugin).find("option 'size_mm' replaces 'Size': names are lower_case"), std::string::npos);
}
TEST(Declaration, FilesBesideWhatIsNoFile) {
  Plugin plugin;
  plugin.node("test.plain", plain)
      .summary("s")
      .in("a", "h")
      .out("b", "h")
      .option("word", &Options::word, "h", marrow::beside({".onnx", "yaml", "../x"}));
  EXPECT_NE(faults(plugin).find("option 'word': beside: files can lie beside an option of type path only"),
            std::string::npos);
  EXPECT_NE(faults(plugin).find("an ending begins with a dot, as .onnx, but this is 'yaml'"), std::string::npos);
  EXPECT_NE(faults(plugin).find("an ending begins with a dot, as .onnx, but this is '../x'"), std::string::npos);
}
TEST(Declaration, OptionNamedTwice) {
  Plugin plugin;
  plugin.node("test.plain", plain)
      .summary("s")
      .in("a", "h")
      .out("b", "h")
      .option("word", &Options::word, "h")
      .option("word", &Options::word, "h");
  EXPECT_NE(faults(plugin).find("option 'word' is named twice"), std::string::npos);
}
TEST(Declaration, NumbersThatCannotBeWrittenDown) {
  struct Odd {
    double x = std::numeric_limits<double>::quiet_NaN();
    double y = 1;
  };
  Metrics (*odd)(const Metrics&, const Odd&) = [](const Metrics& metrics, const Odd&) { return metrics; };
  Plugin plugin;
  plugin.node("test.odd", odd)
      .summary("s")
      .in("a", "h")
      .out("b", "h")
      .option("x", &Odd::x, "h")
      .option("y", &Odd::y, "h", marrow::at_least(2), marrow::at_most(0))
      .option("z", &Odd::y, "h", marrow::at_most(std::numeric_limits<double>::infinity()));
  EXPECT_NE(faults(plugin).find("option 'x': its default is not a finite number"), std::string::npos);
  EXPECT_NE(faults(plugin).find("option 'y': its range is empty or not finite"), std::string::npos);
  EXPECT_NE(faults(plugin).find("option 'z': its range is empty or not finite"), std::string::npos);
}
TEST(Declaration, TextsThatCannotBeShown) {
  for (const char* text : {"\x1b[2J", "two\nlines", "\xff"}) {
    Plugin plugin;
    plugin.node("test.plain", plain).summary(text).in("a", text).out("b", "h").option("word", &Options::word, text);
    EXPECT_NE(faults(plugin).find("summary: its texts must be UTF-8 without control characters"), std::string::npos);
    EXPECT_NE(faults(plugin).find("input 'a': its texts must be UTF-8 without control characters"), std::string::npos);
    EXPECT_NE(faults(plugin).find("option 'word': its texts must be UTF-8 without control characters"),
              std::string::npos);
  }
}
TEST(Declaration, PortNamedTwice) {
  Plugin plugin;
  plugin.node("test.two", two).summary("s").out("a", "h").out("a", "h");
  EXPECT_NE(faults(plugin).find("output 'a' is named twice"), std::string::npos);
}
TEST(Declaration, TupleHasFewerItems) {
  Plugin plugin;
  plugin.node("test.two", two).summary("s").out("a", "h").out("b", "h").out("c", "h");
  EXPECT_NE(faults(plugin).find("output 'c': the returned tuple has fewer items"), std::string::npos);
}
TEST(Declaration, UnregisteredReturnType) {
  Plugin plugin;
  plugin.node("test.nothing", nothing_registered).summary("s").out("a", "h");
  EXPECT_NE(faults(plugin).find("the returned type is not registered with MARROW_VALUE_TYPE"), std::string::npos);
}
TEST(Declaration, Traits) {
  Plugin plugin;
  plugin.node("test.plain", plain).summary("s").in("a", "h").out("b", "h").trait("Fast").trait("good").trait("good");
  EXPECT_NE(faults(plugin).find("trait 'Fast': names are lower_case"), std::string::npos);
  EXPECT_NE(faults(plugin).find("trait 'good' is named twice"), std::string::npos);
}
TEST(Declaration, Kinds) {
  Plugin plugin;
  plugin.kind("edges.x")
      .in<marrow::View>("view", "h")
      .in<marrow::View>("view", "h")
      .in<>("Nothing", "h")
      .trait("fast", "h")
      .trait("fast", "\x1b");
  const std::vector<std::string> expected{"a kind's name is lower_case, without a dot",
                                          "has no summary",
                                          "input 'view' is named twice",
                                          "input 'Nothing': names are lower_case",
                                          "input 'Nothing': has no type",
                                          "trait 'fast': its texts must be UTF-8 without control characters",
                                          "trait 'fast' is named twice"};
  std::vector<std::string> found = plugin.kinds.front().faults;
  EXPECT_EQ(std::set<std::string>(found.begin(), found.end()), std::set<std::string>(expected.begin(), expected.end()));
}
TEST(Declaration, ChecksOfAKind) {
  Plugin plugin;
  marrow::conformance::Suite suite;
  suite.sample = [] { return marrow::conformance::Inputs{}; };
  suite.trials = {{"contract", nullptr}};
  suite.accuracy = {{{"bias", "how far off", std::numeric_limits<double>::infinity(), "mm"}, nullptr}};
  plugin.kind("test").summary("s").suite(suite);
  EXPECT_EQ(plugin.kinds.front().info.checks.size(), 5u);
  EXPECT_EQ(plugin.kinds.front().faults, (std::vector<std::string>{"check 'bias': its limit is not a finite number",
                                                                   "check 'contract' is named twice"}));
}

}  // namespace declaration_test
