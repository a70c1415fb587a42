// SPDX-License-Identifier: Apache-2.0
// Results of earlier runs are read back, and a plan says so beforehand.
#include "tests/framework/store/store_fixture.hpp"

namespace store_test {

using namespace marrow;
using store_fixture::many;
using store_fixture::number;
using store_fixture::StoreTest;
using What = PlannedNode::What;

constexpr const char* kChain =
    "  c: {uses: test.constant, with: {value: 5}}\n  s: {uses: test.sides}\n  f: {uses: test.adder, in: {amount: c}}\n"
    "  a: {uses: test.apply, in: {adder: f, to: s.both}}\n  n: {uses: test.sum, in: {items: a}}\n";

TEST_F(StoreTest, ValuesComeBackAsTheyWere) {
  Value list;
  list.type = number(1).type;
  list.axis = "side";
  list.names = {"a", "b"};
  list.items = {number(1), number(2)};
  Value absent;
  absent.type = number(1).type;
  const Digest key = hash_of(std::string("key"));
  Provenance from;
  from.node = "test.x";
  from.options["low"] = "50";
  from.warnings = {"careful"};
  EXPECT_FALSE(store.find(key));
  EXPECT_EQ(store.save(key, {list, absent, many(100000)}, from), "");
  const auto found = store.find(key);
  ASSERT_TRUE(found);
  EXPECT_EQ(found->provenance.options.at("low"), "50");
  EXPECT_EQ(found->provenance.warnings, from.warnings);
  ASSERT_EQ(found->outputs.size(), 3u);
  EXPECT_EQ(found->outputs[0].names, list.names);
  EXPECT_EQ(found->outputs[0].items[1].as<Metrics>().items[0].value, 2);
  EXPECT_EQ(found->outputs[0].items[1].as<Metrics>().items[0].unit, "mm");
  EXPECT_TRUE(found->outputs[1].is_absent());
  EXPECT_EQ(hash_of(found->outputs[2].as<Volume>()), many(100000).key);
}

TEST_F(StoreTest, SecondRunCallsNothing) {
  const RunResult first = run(kChain, "n: n, a: a");
  EXPECT_EQ(calls(first), 6);
  const RunResult second = run(kChain, "n: n, a: a");
  EXPECT_EQ(calls(second), 0);
  EXPECT_EQ(second.nodes[2].status, NodeRecord::Status::not_needed) << "nothing that runs needs the function";
  EXPECT_EQ(result_of(second), result_of(first));
  EXPECT_EQ(result_of(second), 10 + 5 + 20 + 5);
}

TEST_F(StoreTest, WhatIsReadBackCanBeHandedToAnotherProcess) {
  scratch.write("file.txt", "hello");
  const auto nodes = [](const std::string& value) {
    return "  c: {uses: test.constant, with: {value: 5}}\n"
           "  r: {uses: parse.test_number, in: {added: c}, with: {path: file.txt, value: " +
           value + "}}\n";
  };
  run(nodes("0.25"), "r: r");
  const RunResult second = run(nodes("0.5"), "r: r");
  EXPECT_EQ(second.nodes[0].calls, 0) << "the number is read back";
  ASSERT_EQ(second.nodes[1].status, NodeRecord::Status::done) << messages;
  EXPECT_EQ(result_of(second) - std::floor(result_of(second)), 0.5);
  EXPECT_GE(result_of(second), 5.5);
}

TEST_F(StoreTest, OnlyWhatChangedRunsAndFunctionsAreMadeForIt) {
  run(kChain, "n: n");
  std::string changed = kChain;
  changed.replace(changed.find("value: 5"), 8, "value: 6");
  const RunResult second = run(changed, "n: n");
  EXPECT_EQ(result_of(second), 10 + 6 + 20 + 6);
  EXPECT_EQ(second.nodes[1].calls, 0) << "the sides do not depend on it";
  EXPECT_EQ(second.nodes[2].calls, 1) << "one function for both items";
  EXPECT_EQ(second.nodes[3].calls, 2);
}

TEST_F(StoreTest, UnchangedContentStopsTheWave) {
  run("  c: {uses: test.constant, with: {value: 5, word: one}}\n  d: {uses: test.add, in: {a: c}}\n", "d: d");
  const RunResult second =
      run("  c: {uses: test.constant, with: {value: 5, word: two}}\n  d: {uses: test.add, in: {a: c}}\n", "d: d");
  EXPECT_EQ(second.nodes[0].calls, 1);
  EXPECT_EQ(second.nodes[1].calls, 0) << "the constant is the same as before";
}

TEST_F(StoreTest, ASeedMattersToRandomNodesOnly) {
  const std::string nodes = "  c: {uses: test.constant}\n  d: {uses: test.draw}\n";
  run(nodes, "c: c, d: d", 1);
  const RunResult second = run(nodes, "c: c, d: d", 2);
  EXPECT_EQ(second.nodes[0].calls, 0);
  EXPECT_EQ(second.nodes[1].calls, 1);
}

TEST_F(StoreTest, FailuresAreNotKept) {
  const std::string nodes =
      "  c: {uses: test.constant, with: {value: 9}}\n  f: {uses: test.fail_above, in: {a: c}, with: {value: 1}}\n";
  EXPECT_TRUE(run(nodes, "f: f").failed());
  EXPECT_TRUE(run(nodes, "f: f").failed());
}

TEST_F(StoreTest, AFailedFunctionIsNamedByWhatNeedsIt) {
  const RunResult result =
      run("  c: {uses: test.constant, with: {value: 9}}\n  f: {uses: test.failing_adder, in: {amount: c}}\n"
          "  a: {uses: test.apply, in: {adder: f, to: c}}\n",
          "a: a");
  EXPECT_TRUE(result.failed());
  EXPECT_EQ(result.nodes[1].status, NodeRecord::Status::failed);
  EXPECT_EQ(result.nodes[2].status, NodeRecord::Status::not_run);
  EXPECT_EQ(result.nodes[2].reason, "node 'f' failed");
  EXPECT_EQ(messages, "node 'f' (test.failing_adder) failed: it cannot add (its inputs: amount = c)\n");
}

TEST_F(StoreTest, PlanSaysWhatRunsAndWhy) {
  std::vector<PlannedNode> planned = plan(kChain, "n: n");
  EXPECT_EQ(planned[0].what, What::runs);
  EXPECT_EQ(planned[0].why, "it has not run before");
  run(kChain, "n: n");
  planned = plan(kChain, "n: n");
  EXPECT_EQ(planned[0].what, What::cached);
  EXPECT_EQ(planned[2].what, What::function);
  EXPECT_EQ(planned[4].what, What::cached);

  std::string changed = kChain;
  changed.replace(changed.find("value: 5"), 8, "value: 6");
  planned = plan(changed, "n: n");
  EXPECT_EQ(planned[0].what, What::runs);
  EXPECT_EQ(planned[0].why, "option 'value' is 6, was 5");
  EXPECT_EQ(planned[1].what, What::cached);
  EXPECT_EQ(planned[3].what, What::depends);
  EXPECT_EQ(planned[3].waits_for, (std::set<std::string>{"c"})) << "through the function";
  EXPECT_EQ(planned[4].what, What::depends);

  store.collect(1);
  planned = plan(kChain, "n: n");
  EXPECT_EQ(planned[0].why,
            "the store has no result of it: it failed, was stopped or removed, or the processor is another");
}

TEST_F(StoreTest, PlanComparesWithTheNearestResultThatIsKept) {
  const auto constant = [](const std::string& value, const std::string& count) {
    return "  c: {uses: test.constant, with: {value: " + value + ", count: " + count + "}}\n";
  };
  run(constant("1", "1"), "c: c");
  run(constant("2", "2"), "c: c");
  EXPECT_EQ(plan(constant("1", "3"), "c: c")[0].why, "option 'count' is 3, was 1") << "the last run had another value";
  EXPECT_EQ(plan(constant("2", "3"), "c: c")[0].why, "option 'count' is 3, was 2");
}

TEST_F(StoreTest, WarningsAreRepeated) {
  const std::string nodes = "  w: {uses: test.warn}\n";
  run(nodes, "w: w");
  EXPECT_EQ(messages, "mind the gap\n");
  messages.clear();
  EXPECT_EQ(calls(run(nodes, "w: w")), 0);
  EXPECT_EQ(messages, "mind the gap\n");
}

}  // namespace store_test
