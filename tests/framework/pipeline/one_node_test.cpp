// SPDX-License-Identifier: Apache-2.0
// Calls of one node with values from memory.
#include "marrow/runtime/pipeline/one_node.hpp"

#include <algorithm>

#include "tests/framework/fixture.hpp"

namespace one_node_test {

using marrow::Diagnostics;
using marrow::Metrics;
using marrow::OneNode;
using marrow::Value;

using Inputs = std::vector<std::pair<std::string, Value>>;
using Options = std::vector<std::pair<std::string, std::string>>;

Value number(double value) {
  return Value::of<Metrics>(std::make_shared<const Metrics>(Metrics{{{"value", value, ""}}}));
}

Value list_of(const std::vector<double>& values, const std::string& axis) {
  Value list = number(0);
  list.data.reset();
  list.axis = axis;
  for (std::size_t i = 0; i < values.size(); ++i) {
    list.names.push_back(std::string(1, char('a' + i)));
    list.items.push_back(number(values[i]));
  }
  return list;
}

double number_in(const Value& value) { return value.as<Metrics>().items.at(0).value; }

/// Calls the node, which must succeed, and returns its output.
Value called(const std::string& name, const Inputs& inputs, const Options& options = {}) {
  Diagnostics diagnostics;
  const marrow::Catalogue& catalogue = runtime_fixture::test_catalogue();
  const OneNode one = marrow::pipeline_of_node(name, inputs, options, catalogue, diagnostics);
  EXPECT_TRUE(diagnostics.empty()) << diagnostics.text();
  marrow::RunSettings settings;
  settings.given = one.given;
  const marrow::RunResult result = marrow::run_pipeline(one.pipeline, catalogue, settings);
  EXPECT_FALSE(result.failed());
  return marrow::value_of(result, one.pipeline.outputs.at(0).source);
}

/// All faults, one a line.
std::string faults(const std::string& name, const Inputs& inputs, const Options& options = {}) {
  Diagnostics diagnostics;
  marrow::pipeline_of_node(name, inputs, options, runtime_fixture::test_catalogue(), diagnostics);
  std::string text;
  for (const marrow::Diagnostic& one : diagnostics.sorted())
    text += one.place.file + ": " + one.message + (one.hint.empty() ? "" : " [" + one.hint + "]") + "\n";
  return text;
}

TEST(OneNodeTest, TakesInputsAndOptions) {
  EXPECT_EQ(number_in(called("test.add", {{"a", number(2)}, {"b", number(5)}})), 7);
  EXPECT_EQ(number_in(called("test.constant", {}, {{"value", "3.5"}})), 3.5);
}

TEST(OneNodeTest, IsCalledForEachItemOfAListThatThePortDoesNotTakeWhole) {
  const Value sums = called("test.add", {{"a", list_of({1, 2}, "letter")}, {"b", number(10)}});
  EXPECT_EQ(sums.axis, "letter");
  EXPECT_EQ(sums.names, (std::vector<std::string>{"a", "b"}));
  EXPECT_EQ(number_in(sums.items.at(1)), 12);
  EXPECT_EQ(number_in(called("test.sum", {{"items", list_of({1, 2, 4}, "side")}})), 7) << "taken whole";
}

TEST(OneNodeTest, NestsListsOverDifferentAxes) {
  const Value sums = called("test.add", {{"a", list_of({1, 2}, "row")}, {"b", list_of({10, 20, 30}, "column")}});
  EXPECT_EQ(sums.axis, "row");
  EXPECT_EQ(sums.items.at(1).axis, "column");
  EXPECT_EQ(number_in(sums.items.at(1).items.at(2)), 32);
}

TEST(OneNodeTest, AllFaultsComeAtOnceWithTheirPlaces) {
  const Value other = Value::of<marrow::Stop>(std::make_shared<const marrow::Stop>());
  EXPECT_EQ(faults("test.add", {{"a", other}, {"c", number(1)}}, {{"valu", "1"}}),
            "test.add(a): input 'a' of test.add expects metrics, got stop [first]\n"
            "test.add(c): 'test.add' has no input 'c' [did you mean 'a'?]\n"
            "test.add(valu): 'test.add' has no option 'valu' [there are none]\n");
  EXPECT_EQ(faults("test.add", {}), "test.add(a): test.add needs the input 'a', of type metrics [first]\n");
  EXPECT_EQ(number_in(called("test.add", {{"a", number(2)}})), 2) << "the other input is optional";
  EXPECT_HAS(faults("test.constant", {}, {{"count", "-1"}, {"value", "much"}}),
             "option 'count' of test.constant: -1 is below the least allowed, 0\n");
  EXPECT_HAS(faults("test.constant", {}, {{"count", "-1"}, {"value", "much"}}),
             "option 'value' of test.constant: expected a number");
  EXPECT_EQ(faults("test.ad", {}), "test.ad: unknown node 'test.ad' [did you mean 'test.add'?]\n");
}

TEST(OneNodeTest, RelationsBetweenInputsAndOptionsAreChecked) {
  const std::string found = faults("test.any", {});
  EXPECT_EQ(std::count(found.begin(), found.end(), '\n'), 1) << found;
  EXPECT_HAS(found, "'in.items'");
  EXPECT_HAS(found, "'in.adder'");
}

}  // namespace one_node_test
