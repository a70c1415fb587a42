// SPDX-License-Identifier: Apache-2.0
// Relations between options. A pipeline that breaks one has a fault at the option. A relation that makes no sense is a
// fault of the plugin that declares it.
#include "tests/framework/pipeline/pipeline_fixture.hpp"

namespace relations_test {

using marrow::Override;
using marrow::Plugin;

const marrow::Catalogue& related_nodes() {
  static const marrow::Catalogue catalogue({std::filesystem::path(MARROW_BINARY_DIR) / "tests" / "relation_plugins"});
  return catalogue;
}

class RelationsTest : public pipeline_fixture::PipelineTest {
 protected:
  const marrow::Catalogue& catalogue() const override { return related_nodes(); }
  /// Reads a pipeline whose node n, in line 4, is this text.
  void read_node(const std::string& node, const std::vector<Override>& overrides = {}) {
    read(kBefore + node + "\noutputs: {o: n}\n", {{}, overrides});
  }
  void expect_kept(const std::string& node, const std::vector<Override>& overrides = {}) {
    read_node(node, overrides);
    EXPECT_TRUE(diagnostics.empty()) << node << "\n" << diagnostics.text();
  }
  /// There must be one fault, with this message and hint, at the text `at` of the line.
  void expect_broken(const std::string& node, const std::string& at, const std::string& message,
                     const std::string& hint = "") {
    read_node(node);
    const marrow::Diagnostic fault = only_fault();
    const std::string line = kBefore.substr(kBefore.rfind('\n') + 1) + node;
    EXPECT_EQ(fault.message, message);
    EXPECT_EQ(fault.hint, hint);
    EXPECT_EQ(fault.place.line, 4);
    EXPECT_EQ(fault.place.column, int(line.find(at)) + 1) << diagnostics.text();
  }
  /// The same for a relation that an override breaks.
  void expect_broken_by(const std::string& node, const Override& override, const std::string& message) {
    read_node(node, {override});
    const marrow::Diagnostic fault = only_fault();
    EXPECT_EQ(fault.message, message);
    EXPECT_EQ(fault.place.line, 0);
    EXPECT_EQ(fault.place.file, "--set " + override.key + "=" + override.value);
  }

  const std::string kBefore = "marrow: 1\nnodes:\n  one: {uses: test.number}\n  n: ";
};

TEST_F(RelationsTest, NotAboveAndBelow) {
  expect_kept("{uses: test.limits}");
  expect_kept("{uses: test.limits, with: {low: 75}}");
  expect_kept("{uses: test.limits, with: {low: 90, high: 90.5}}");
  expect_broken("{uses: test.limits, with: {low: 90}}", "low",
                "option 'low' of test.limits is 90, which is above option 'high' (75)");
  expect_broken("{uses: test.limits, with: {high: 49.5}}", "high",
                "option 'low' of test.limits is 50, which is above option 'high' (49.5)");
  expect_kept("{uses: test.limits, with: {near_mm: 999.9}}");
  expect_kept("{uses: test.limits, with: {first: 9}}");
  expect_broken("{uses: test.limits, with: {far_mm: 600}}", "far_mm",
                "option 'near_mm' of test.limits is 600, which is not below option 'far_mm' (600)");
  expect_broken("{uses: test.limits, with: {near_mm: 1200}}", "near_mm",
                "option 'near_mm' of test.limits is 1200, which is not below option 'far_mm' (1000)");
  expect_broken("{uses: test.limits, with: {first: 10}}", "first",
                "option 'first' of test.limits is 10, which is not below option 'last' (10)");
}

TEST_F(RelationsTest, LengthsOfLists) {
  expect_kept("{uses: test.lists}");
  expect_kept("{uses: test.lists, with: {alpha_deg: [1, 2, 3], beta_deg: [4, 5, 6]}}");
  expect_kept("{uses: test.lists, with: {alpha_deg: [], beta_deg: []}}");
  expect_kept("{uses: test.lists, with: {sizes: [1, 2], weights: [3, 4], labels: [a, b]}}");
  expect_broken("{uses: test.lists, with: {beta_deg: [0, 60, 90]}}", "beta_deg",
                "options 'alpha_deg' (2) and 'beta_deg' (3) of test.lists must have the same length");
  expect_broken("{uses: test.lists, with: {alpha_deg: []}}", "alpha_deg",
                "options 'alpha_deg' (0) and 'beta_deg' (2) of test.lists must have the same length");
  expect_broken("{uses: test.lists, with: {weights: [1]}}", "weights",
                "options 'sizes' (0), 'weights' (1) and 'labels' (0) of test.lists must have the same length");
  expect_kept("{uses: test.lists, with: {paths: [a, b, c]}}");
  expect_kept("{uses: test.lists, with: {paths: [a, b, c], names: []}}");
  expect_kept("{uses: test.lists, with: {paths: [a, b, c], names: [x, y, z]}}");
  const std::string hint = "give one for each, or none";
  expect_broken("{uses: test.lists, with: {names: [x]}}", "names",
                "option 'names' of test.lists has 1 item, but 'paths' has 0", hint);
  expect_broken("{uses: test.lists, with: {paths: [a, b, c], names: [x, y]}}", "paths",
                "option 'names' of test.lists has 2 items, but 'paths' has 3", hint);
}

TEST_F(RelationsTest, HowManyAreGivenAndAllDistinct) {
  expect_kept("{uses: test.one_of_two, with: {file: a}}");
  expect_kept("{uses: test.one_of_two, in: {number: one}}");
  expect_kept("{uses: test.one_of_two, in: {number: one}, with: {file: ''}}");
  expect_kept("{uses: test.one_of_three, in: {number: one}, with: {words: []}}");
  expect_kept("{uses: test.one_of_three, with: {words: [a, b]}}");
  expect_broken("{uses: test.one_of_two}",
                "n:", "test.one_of_two needs exactly one of 'in.number' and 'file', got none");
  expect_broken("{uses: test.one_of_two, with: {file: ''}}", "file",
                "test.one_of_two needs exactly one of 'in.number' and 'file', got none");
  expect_broken("{uses: test.one_of_two, in: {number: one}, with: {file: a}}", "file",
                "test.one_of_two needs exactly one of 'in.number' and 'file', got both");
  expect_broken("{uses: test.one_of_three}",
                "n:", "test.one_of_three needs exactly one of 'in.number', 'file' and 'words', got none");
  expect_broken("{uses: test.one_of_three, in: {number: one}, with: {words: [a]}}", "words",
                "test.one_of_three needs exactly one of 'in.number', 'file' and 'words', got 'in.number' and 'words'");
  expect_kept("{uses: test.one_or_both, with: {file: a}}");
  expect_kept("{uses: test.one_or_both, in: {number: one}, with: {file: a}}");
  expect_broken("{uses: test.one_or_both}",
                "n:", "test.one_or_both needs at least one of 'in.number' and 'file', got none");
  expect_broken("{uses: test.each_once, with: {words: []}}", "words", "option 'words' of test.each_once is empty",
                "give one item or more");
  expect_kept("{uses: test.each_once, with: {words: [a, A, b], sizes: [1, 2, 1.5]}}");
  expect_broken("{uses: test.each_once, with: {words: [b, a, b]}}", "words",
                "option 'words' of test.each_once has 'b' twice", "give each item once");
  expect_broken("{uses: test.each_once, with: {sizes: [2, 1, 2.0]}}", "sizes",
                "option 'sizes' of test.each_once has '2' twice", "give each item once");
}

TEST_F(RelationsTest, OverridesBreakAndMend) {
  expect_broken_by("{uses: test.limits}", {"n.low", "90"},
                   "option 'low' of test.limits is 90, which is above option 'high' (75)");
  expect_broken_by("{uses: test.limits, with: {near_mm: 700}}", {"n.near_mm", "1000"},
                   "option 'near_mm' of test.limits is 1000, which is not below option 'far_mm' (1000)");
  expect_broken_by("{uses: test.lists}", {"n.beta_deg", "[0, 60, 90]"},
                   "options 'alpha_deg' (2) and 'beta_deg' (3) of test.lists must have the same length");
  expect_broken_by("{uses: test.lists}", {"n.names", "[x]"},
                   "option 'names' of test.lists has 1 item, but 'paths' has 0");
  expect_broken_by("{uses: test.one_of_two, in: {number: one}}", {"n.file", "a"},
                   "test.one_of_two needs exactly one of 'in.number' and 'file', got both");
  expect_broken_by("{uses: test.one_of_two, with: {file: a}}", {"n.file", "''"},
                   "test.one_of_two needs exactly one of 'in.number' and 'file', got none");

  expect_kept("{uses: test.limits, with: {low: 90}}", {{"n.high", "95"}});
  expect_kept("{uses: test.limits, with: {far_mm: 500}}", {{"n.near_mm", "400"}});
  expect_kept("{uses: test.lists, with: {beta_deg: [0, 60, 90]}}", {{"n.alpha_deg", "[0, 0, 0]"}});
  expect_kept("{uses: test.lists, with: {names: [x]}}", {{"n.paths", "[a]"}});
  expect_kept("{uses: test.one_of_two}", {{"n.in.number", "one"}});
  expect_kept("{uses: test.one_of_two, in: {number: one}, with: {file: a}}", {{"n.file", "''"}});
}

TEST_F(RelationsTest, EachFaultIsShownOnceWithItsLine) {
  read_node("{uses: test.limits, with: {low: 90, first: 20}}");
  EXPECT_EQ(diagnostics.size(), 2u) << diagnostics.text();
  read_node("{uses: test.limits, with: {low: ninety}}");
  expect_shown("expected a number, got 'ninety'");
  read_node("{uses: test.limits, with: {low: 101}}");
  expect_shown("101 is above the most allowed, 100");
  read_node("{uses: test.limits, with: {low: 90}}");
  expect_shown(
      "p.yaml:4:33: error: option 'low' of test.limits is 90, which is above option 'high' (75)\n"
      "    n: {uses: test.limits, with: {low: 90}}\n");
}

struct Options {
  double low = 1, high = 2;
  std::string name = "a";
  std::vector<double> list;
};
marrow::Metrics node_function(const marrow::Metrics*, const Options&) { return {}; }

/// The faults of a plugin that declares this relation, one a line.
std::string faults_of(const marrow::RelationInfo& relation) {
  Plugin plugin;
  plugin.node("test.node", node_function)
      .summary("s")
      .in("input", "h")
      .out("output", "h")
      .option("low", &Options::low, "h")
      .option("high", &Options::high, "h")
      .option("name", &Options::name, "h")
      .option("list", &Options::list, "h")
      .relation(relation);
  std::string text;
  for (const std::string& fault : plugin.nodes.back().faults) text += fault + "\n";
  return text;
}

TEST(RelationDeclaration, GoodOnesAreKept) {
  EXPECT_EQ(faults_of(marrow::not_above("low", "high")), "");
  EXPECT_EQ(faults_of(marrow::exactly_one({"in.input", "name"})), "");
  EXPECT_EQ(faults_of(marrow::exactly_one({"list", "name"})), "");
  EXPECT_EQ(faults_of(marrow::at_least_one({"name"})), "");
  const marrow::NodeInfo* limits = related_nodes().find("test.limits");
  ASSERT_TRUE(limits);
  ASSERT_EQ(limits->relations.size(), 3u);
  EXPECT_EQ(limits->relations[1].type, marrow::RelationType::below);
  EXPECT_EQ(limits->relations[1].names, (std::vector<std::string>{"near_mm", "far_mm"}));
}
TEST(RelationDeclaration, BadOnesAreFaults) {
  for (const auto& [relation, fault] : std::vector<std::pair<marrow::RelationInfo, std::string>>{
           {marrow::not_above("lo", "high"), "not_above: there is no option 'lo'; did you mean 'low'?"},
           {marrow::not_above("name", "high"), "not_above: option 'name' is not a number"},
           {marrow::below("low", "name"), "below: option 'name' is not a number"},
           {marrow::same_length({"low", "list"}), "same_length: option 'low' is not a list"},
           {marrow::as_many_or_none("list", "high"), "as_many_or_none: option 'high' is not a list"},
           {marrow::exactly_one({"name"}), "exactly_one: it needs two names or more"},
           {marrow::at_least_one({}), "at_least_one: it needs a name"},
           {{marrow::RelationType::distinct, {"list", "list"}}, "distinct: it needs one name"},
           {marrow::distinct("name"), "distinct: option 'name' is not a list"},
           {marrow::at_least_one({"low"}), "at_least_one: option 'low' is never empty, so it is always given"}})
    EXPECT_EQ(faults_of(relation), "relation " + fault + "\n");
}

}  // namespace relations_test
