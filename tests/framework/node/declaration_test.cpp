// SPDX-License-Identifier: Apache-2.0
// What is wrong with a declaration is found when the plugin registers.
#include <gtest/gtest.h>

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
int nothing_registered() { return 1; }

/// Declares a node in a plugin of its own. Gives what is wrong with it, a fault a line.
template <class Declare>
std::string faults(const Declare& declare) {
  Plugin plugin;
  declare(plugin);
  std::string text;
  for (const std::string& fault : plugin.nodes.back().faults) text += fault + "\n";
  return text;
}
/// The same of the option of a node on which nothing else is wrong.
template <class Member, class... Attributes>
std::string option_faults(const char* name, Member member, Attributes... attributes) {
  return faults([&](Plugin& plugin) {
    plugin.node("test.plain", plain).summary("s").in("a", "h").out("b", "h").option(name, member, "h", attributes...);
  });
}
void expect_faults(const std::string& found, const std::vector<std::string>& expected) {
  for (const std::string& fault : expected) EXPECT_NE(found.find(fault), std::string::npos) << fault << "\n" << found;
}

TEST(Declaration, GoodOneHasNoFaults) {
  Plugin plugin;
  plugin.node("test.plain", plain)
      .summary("s")
      .in("a", "h")
      .out("b", "h")
      .option("size_mm", &Options::size_mm, "h", marrow::at_least(0));
  const marrow::NodeInfo& info = plugin.nodes.back().info;
  EXPECT_TRUE(plugin.nodes.back().faults.empty());
  EXPECT_EQ(info.options[0].unit, "mm") << "read off the name";
  EXPECT_EQ(info.inputs[0].type.id, "metrics");
  EXPECT_EQ(info.kind(), "test");
}
TEST(Declaration, FaultsOfNamesAndPorts) {
  using Declare = void (*)(Plugin&);
  const std::vector<std::pair<Declare, std::vector<std::string>>> rows{
      {[](Plugin& p) { p.node("test.plain", plain).summary("s").out("b", "h"); },
       {"the function takes 1 inputs, but .in() names 0"}},
      {[](Plugin& p) { p.node("test.listed", listed).summary("s").in("a", "h").out("b", "h"); },
       {"input 'a': a List needs over(\"axis\")", "output 'b': a List needs over(\"axis\")"}},
      {[](Plugin& p) { p.node("Plain", plain).in("a", "h"); },
       {"has no summary", "has no output", "a node's name is kind.name in lower_case"}},
      {[](Plugin& p) { p.node("test.two", two).summary("s").out("a", "h").out("a", "h"); },
       {"output 'a' is named twice"}},
      {[](Plugin& p) { p.node("test.two", two).summary("s").out("a", "h").out("b", "h").out("c", "h"); },
       {"output 'c': the returned tuple has fewer items"}},
      {[](Plugin& p) { p.node("test.nothing", nothing_registered).summary("s").out("a", "h"); },
       {"the returned type is not registered with MARROW_VALUE_TYPE"}},
      {[](Plugin& p) {
         p.node("test.plain", plain).summary("s").in("a", "h").out("b", "h").trait("Fast").trait("good").trait("good");
       },
       {"trait 'Fast': names are lower_case", "trait 'good' is named twice"}},
      {[](Plugin& p) {
         p.node("test.plain", plain)
             .summary("s")
             .in("a", "h")
             .out("b", "h")
             .option("word", &Options::word, "h")
             .option("word", &Options::word, "h");
       },
       {"option 'word' is named twice"}}};
  for (const auto& [declare, expected] : rows) expect_faults(faults(declare), expected);
}
TEST(Declaration, FaultsOfOptions) {
  expect_faults(option_faults("word", &Options::word, marrow::one_of({"x", "y"})),
                {"option 'word': its default 'a' is not one of its choices"});
  const std::string replaced =
      option_faults("size_mm", &Options::size_mm, marrow::replaces({"size_mm", "a.size_mm", "Size"}));
  EXPECT_EQ(replaced.find("replaces 'size_mm'"), std::string::npos);
  expect_faults(replaced, {"option 'size_mm' replaces 'a.size_mm': there is no input 'a' that takes functions",
                           "option 'size_mm' replaces 'Size': names are lower_case"});
  expect_faults(option_faults("word", &Options::word, marrow::beside({".onnx", "yaml", "../x"})),
                {"option 'word': beside: files can lie beside an option of type path only",
                 "an ending begins with a dot, as .onnx, but this is 'yaml'",
                 "an ending begins with a dot, as .onnx, but this is '../x'"});
}
TEST(Declaration, NumbersThatCannotBeWrittenDown) {
  struct Odd {
    double x = std::numeric_limits<double>::quiet_NaN();
    double y = 1;
  };
  Metrics (*odd)(const Metrics&, const Odd&) = [](const Metrics& metrics, const Odd&) { return metrics; };
  const std::string found = faults([&](Plugin& plugin) {
    plugin.node("test.odd", odd)
        .summary("s")
        .in("a", "h")
        .out("b", "h")
        .option("x", &Odd::x, "h")
        .option("y", &Odd::y, "h", marrow::at_least(2), marrow::at_most(0))
        .option("z", &Odd::y, "h", marrow::at_most(std::numeric_limits<double>::infinity()));
  });
  expect_faults(found,
                {"option 'x': its default is not a finite number", "option 'y': its range is empty or not finite",
                 "option 'z': its range is empty or not finite"});
}
TEST(Declaration, TextsThatCannotBeShown) {
  const std::string said = ": its texts must be UTF-8 without control characters";
  for (const char* text : {"\x1b[2J", "two\nlines", "\xff"})
    expect_faults(faults([&](Plugin& plugin) {
                    plugin.node("test.plain", plain)
                        .summary(text)
                        .in("a", text)
                        .out("b", "h")
                        .option("word", &Options::word, text);
                  }),
                  {"summary" + said, "input 'a'" + said, "option 'word'" + said});
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
TEST(Declaration, ASuiteOfAKindFromElsewhere) {
  Plugin plugin;
  plugin.suite("test", {});
  EXPECT_EQ(plugin.kinds.front().faults, std::vector<std::string>{"its suite has no checks"});
  marrow::conformance::Suite suite;
  suite.accuracy = {{{"bias", "how far off", 1, "mm"}, nullptr}};
  plugin.suite("test", suite);
  EXPECT_TRUE(plugin.kinds.back().info.is_suite);
  EXPECT_EQ(plugin.kinds.back().faults, std::vector<std::string>{});
}

}  // namespace declaration_test
