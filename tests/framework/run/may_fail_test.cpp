// SPDX-License-Identifier: Apache-2.0
// A node that may fail costs only itself and what cannot do without it.
#include "marrow/runtime/run/node_calls.hpp"
#include "tests/framework/pipeline/pipeline_fixture.hpp"
#include "tests/framework/store/store_fixture.hpp"

namespace may_fail_test {

using namespace marrow;
using Status = NodeRecord::Status;
using What = PlannedNode::What;

/// Numbers, the first node that fails, and what it says.
const std::string kNumbers = "  c: {uses: test.constant, with: {value: 5}}\n  s: {uses: test.sides}\n";
const std::string kFails = "  f: {uses: test.fail_above, in: {a: c}, with: {value: 1}, may_fail: true}\n";
const std::string kFailsForB = "  f: {uses: test.fail_above, in: {a: s.both}, with: {value: 15}, may_fail: true}\n";

class MayFailTest : public store_fixture::StoreTest {
 protected:
  RunResult run(const std::string& nodes, const std::string& outputs) {
    failures.clear();
    settings.store = &store;
    on_event = [this](const RunEvent& event) {
      if (event.kind == RunEvent::Kind::failed) failures[event.text] = event.level;
    };
    return RunTest::run(nodes, outputs);
  }
  PlannedNode planned(const std::string& id, const std::string& nodes, const std::string& outputs) {
    const std::vector<PlannedNode> all = plan(nodes, outputs);
    for (std::size_t i = 0; i < pipeline.nodes.size(); ++i)
      if (pipeline.nodes[i].id == id) return all[i];
    throw marrow::Error("no node " + id);
  }
  std::map<std::string, LogLevel> failures;
};

TEST_F(MayFailTest, TheRunGoesOnAndAnInputThatIsNotNeededIsLeftOut) {
  const RunResult result = run(kNumbers + kFails + "  d: {uses: test.add, in: {a: c, b: f}}\n", "d: d, f: f");
  EXPECT_FALSE(result.failed());
  EXPECT_EQ(result_of(result), 5) << "without what would be added";
  const NodeRecord& failed = record(result, "f");
  EXPECT_EQ(failed.status, Status::failed_alone);
  EXPECT_STREQ(status_name(failed.status), "failed alone");
  EXPECT_EQ(failed.reason, "the number is too large; give a smaller one");
  EXPECT_EQ(failed.stopped, 0);
  EXPECT_EQ(failures, (std::map<std::string, LogLevel>{
                          {"node 'f' (test.fail_above) failed: the number is too large; give a smaller one (its "
                           "inputs: a = c); the run goes on without it",
                           LogLevel::warning}}));
  const Value absent = output(result, 1);
  EXPECT_TRUE(absent.is_absent());
  EXPECT_TRUE(absent.may_be_missing);
  EXPECT_EQ(absent.missing, "node 'f' failed");
}

TEST_F(MayFailTest, WithoutTheWordTheRunFails) {
  const RunResult result = run(kNumbers + "  f: {uses: test.fail_above, in: {a: c}, with: {value: 1}}\n", "f: f");
  EXPECT_TRUE(result.failed());
  ASSERT_EQ(failures.size(), 1u);
  EXPECT_EQ(failures.begin()->second, LogLevel::error);
  EXPECT_EQ(failures.begin()->first.find("goes on"), std::string::npos);
  EXPECT_FALSE(output(result).may_be_missing);
}

TEST_F(MayFailTest, WhatNeedsItFailsToo) {
  const RunResult result = run(kNumbers + kFails +
                                   "  g: {uses: test.add, in: {a: f}, may_fail: true}\n"
                                   "  h: {uses: test.add, in: {a: g}, may_fail: true}\n"
                                   "  d: {uses: test.add, in: {a: c, b: h}}\n",
                               "d: d");
  EXPECT_FALSE(result.failed());
  EXPECT_EQ(result_of(result), 5);
  EXPECT_EQ(record(result, "g").status, Status::failed_alone);
  EXPECT_EQ(record(result, "g").reason, "it needs 'a', but node 'f' failed");
  EXPECT_EQ(record(result, "h").reason, "it needs 'a', but node 'g' failed");
  EXPECT_EQ(record(result, "g").calls, 0);
  EXPECT_TRUE(
      failures.contains("node 'g' (test.add) failed: it needs 'a', but node 'f' failed (its inputs: a = f); the "
                        "run goes on without it"));
}

TEST_F(MayFailTest, AlongAnAxisOnlyTheFailedItemIsMissing) {
  const RunResult result = run(kNumbers + kFailsForB +
                                   "  g: {uses: test.add, in: {a: f}, may_fail: true}\n"
                                   "  h: {uses: test.add, in: {a: s.both, b: f}}\n",
                               "g: g, h: h");
  EXPECT_FALSE(result.failed());
  EXPECT_EQ(record(result, "f").reason, "b: the number is too large; give a smaller one");
  EXPECT_EQ(record(result, "g").status, Status::failed_alone);
  EXPECT_EQ(record(result, "g").reason, "b: it needs 'a', but node 'f' failed");
  ASSERT_EQ(output(result, 0).names, (std::vector<std::string>{"a", "b"}));
  EXPECT_EQ(number_of(output(result, 0).items[0]), 10);
  EXPECT_TRUE(output(result, 0).items[1].may_be_missing);
  EXPECT_EQ(number_of(output(result, 1).items[0]), 10 + 10);
  EXPECT_EQ(number_of(output(result, 1).items[1]), 20);
}

TEST_F(MayFailTest, AListWithoutAnItemIsNotThereAtAll) {
  const std::string adder = "  p: {uses: test.adder, in: {amount: c}}\n";
  const RunResult result = run(kNumbers + adder + kFailsForB +
                                   "  g: {uses: test.any, in: {items: f, adder: p}}\n"
                                   "  h: {uses: test.any, in: {items: [c, f.b], adder: p}}\n"
                                   "  i: {uses: test.sum, in: {items: f}, may_fail: true}\n"
                                   "  j: {uses: test.any, in: {items: [c, f.a], adder: p}}\n",
                               "g: g, h: h, i: i, j: j");
  EXPECT_FALSE(result.failed());
  EXPECT_EQ(result_of(result, 0), 5);
  EXPECT_EQ(result_of(result, 1), 5);
  EXPECT_EQ(record(result, "i").reason, "it needs 'items', but node 'f' failed");
  EXPECT_EQ(result_of(result, 3), 5 + 10 + 5) << "the item that this list has is there";
}

TEST_F(MayFailTest, ARelationOfInputsHoldsForThoseThatAreThere) {
  const RunResult result = run(kNumbers + kFails + "  g: {uses: test.any, in: {items: f}}\n", "g: g");
  EXPECT_TRUE(result.failed()) << "it is not said that g may fail";
  EXPECT_EQ(record(result, "g").status, Status::failed);
  EXPECT_EQ(record(result, "g").reason,
            "test.any needs at least one of 'in.items' and 'in.adder', got none, because node 'f' failed");
}

TEST_F(MayFailTest, AFunctionMayFailToo) {
  const std::string adder = "  p: {uses: test.failing_adder, in: {amount: c}, may_fail: true}\n";
  const std::string nodes = kNumbers + adder +
                            "  g: {uses: test.any, in: {items: s.both, adder: p}}\n"
                            "  h: {uses: test.apply, in: {adder: p, to: c}, may_fail: true}\n"
                            "  d: {uses: test.add, in: {a: c, b: h}}\n";
  for (const int calls_of_g : {1, 0}) {
    const RunResult result = run(nodes, "g: g, d: d");
    EXPECT_FALSE(result.failed());
    EXPECT_EQ(result_of(result, 0), 10 + 20);
    EXPECT_EQ(result_of(result, 1), 5);
    EXPECT_EQ(record(result, "p").status, Status::failed_alone);
    EXPECT_EQ(record(result, "p").reason, "it cannot add");
    EXPECT_EQ(record(result, "p").calls, 1) << "whether it fails must be known, whatever the store has";
    EXPECT_EQ(record(result, "h").reason, "it needs 'adder', but node 'p' failed");
    EXPECT_EQ(record(result, "g").calls, calls_of_g);
  }
}

TEST_F(MayFailTest, AFunctionThatDoesNotFailGivesTheSameKeysAsOneThatMayNot) {
  const auto nodes = [](const std::string& may_fail) {
    return kNumbers + "  p: {uses: test.adder, in: {amount: c}" + may_fail +
           "}\n  g: {uses: test.any, in: {items: s.both, adder: p}}\n";
  };
  EXPECT_EQ(result_of(run(nodes(""), "g: g")), 10 + 20 + 5);
  const RunResult result = run(nodes(", may_fail: true"), "g: g");
  EXPECT_EQ(result_of(result), 10 + 20 + 5);
  EXPECT_EQ(record(result, "p").status, Status::done);
  EXPECT_EQ(record(result, "g").calls, 0);
}

TEST_F(MayFailTest, TheStoreHasNoFailureAndTellsWhatIsThereFromWhatIsNot) {
  const std::string user = "  d: {uses: test.add, in: {a: c, b: f}}\n";
  const std::string passes = "  f: {uses: test.fail_above, in: {a: c}, with: {value: 9}, may_fail: true}\n";
  run(kNumbers + kFails + user, "d: d");
  const RunResult again = run(kNumbers + kFails + user, "d: d");
  EXPECT_EQ(record(again, "f").calls, 1) << "tried again";
  EXPECT_EQ(record(again, "d").calls, 0);
  const RunResult unwired = run(kNumbers + "  d: {uses: test.add, in: {a: c}}\n", "d: d");
  EXPECT_EQ(record(unwired, "d").calls, 0) << "the same as not wired";
  const RunResult there = run(kNumbers + passes + user, "d: d");
  EXPECT_EQ(result_of(there), 5 + 5);
  EXPECT_EQ(record(there, "d").calls, 1);
}

TEST_F(MayFailTest, ThePlanSaysWhatRunsBecauseItFailed) {
  const std::string nodes = kNumbers + kFails +
                            "  d: {uses: test.add, in: {a: c, b: f}}\n"
                            "  p: {uses: test.adder, in: {amount: c}, may_fail: true}\n"
                            "  g: {uses: test.any, in: {adder: p}}\n";
  run(nodes, "d: d, g: g");
  const std::string outputs = "d: d, g: g";
  EXPECT_EQ(planned("c", nodes, outputs).what, What::cached);
  EXPECT_EQ(planned("f", nodes, outputs).what, What::runs);
  EXPECT_EQ(planned("f", nodes, outputs).why,
            "the store has no result of it: it failed, was stopped or removed, or the processor is another");
  EXPECT_EQ(planned("d", nodes, outputs).what, What::depends);
  EXPECT_EQ(planned("d", nodes, outputs).waits_for, (std::set<std::string>{"f"}));
  EXPECT_EQ(planned("p", nodes, outputs).what, What::runs);
  EXPECT_EQ(planned("p", nodes, outputs).why, "it may fail, and a function is not kept");
  EXPECT_EQ(planned("g", nodes, outputs).waits_for, (std::set<std::string>{"p"}));
}

TEST_F(MayFailTest, AfterAFailureThatEndsTheRunWhatMayFailIsNotRun) {
  const RunResult result =
      run(kNumbers +
              "  e: {uses: test.fail_above, in: {a: c}, with: {value: 1}}\n"
              "  g: {uses: test.add, in: {a: e}, may_fail: true}\n  d: {uses: test.add, in: {a: c, b: g}}\n",
          "d: d");
  EXPECT_TRUE(result.failed());
  EXPECT_EQ(record(result, "e").stopped, 2);
  EXPECT_EQ(record(result, "g").status, Status::not_run);
  EXPECT_EQ(record(result, "d").reason, "node 'e' failed");
}

TEST_F(MayFailTest, OfTwoNodesWithOneRecipeEachFailsInItsOwnWay) {
  const std::string other = "  e: {uses: test.fail_above, in: {a: c}, with: {value: 1}}\n";
  for (const std::string& nodes : {kNumbers + kFails + other, kNumbers + other + kFails}) {
    const RunResult result = run(nodes, "e: e, f: f");
    EXPECT_TRUE(result.failed());
    EXPECT_EQ(record(result, "e").status, Status::failed);
    EXPECT_EQ(failures.at("node 'e' (test.fail_above) failed: the number is too large; give a smaller one (its inputs: "
                          "a = c)"),
              LogLevel::error);
  }
}

TEST_F(MayFailTest, AReaderThatCrashesOrExceedsItsLimits) {
  const std::string nodes = kNumbers +
                            "  r: {uses: parse.test_number, with: {path: file.txt}, may_fail: true}\n"
                            "  d: {uses: test.add, in: {a: c, b: r}}\n";
  settings.file_limits = {0, 0.2};
  for (const char* word : {"crash", "refuse", "spin"}) {
    scratch.write("file.txt", word);
    const RunResult result = run(nodes, "d: d");
    EXPECT_FALSE(result.failed()) << word;
    EXPECT_EQ(result_of(result), 5);
    EXPECT_EQ(record(result, "r").status, Status::failed_alone);
    EXPECT_FALSE(record(result, "r").reason.empty());
  }
}

TEST_F(MayFailTest, ItsDamagedResultThatCannotBeMadeAgainIsAFailure) {
  const std::string nodes = "  r: {uses: parse.test_number, with: {path: file.txt}, may_fail: true}\n";
  scratch.write("file.txt", "hello");
  run(nodes, "r: r");
  std::fstream stream(store_fixture::only_file(store.folder()), std::ios::in | std::ios::out | std::ios::binary);
  stream.seekp(-1, std::ios::end);
  stream.put('x');
  stream.close();
  settings.file_limits = {1e-3, 0};
  const std::string user = kNumbers + nodes + "  d: {uses: test.add, in: {a: c, b: r}}\n";
  const RunResult result = run(user, "d: d");
  EXPECT_TRUE(result.failed()) << "the key of d says that r is there";
  EXPECT_EQ(record(result, "d").reason, "node 'r' failed, and its result in the store is damaged; run it again");
  EXPECT_EQ(result_of(run(user, "d: d")), 5) << "now it is known before";
}

TEST_F(MayFailTest, WhatIsCalledForItemsThatNobodyKnowsFails) {
  const std::string nodes = kNumbers +
                            "  t: {uses: test.sides, with: {names: [a, x]}}\n"
                            "  f: {uses: test.add, in: {a: s.both, b: t.both}, may_fail: true}\n";
  const RunResult result =
      run(nodes +
              "  g: {uses: test.add, in: {a: c, b: f}, may_fail: true}\n"
              "  h: {uses: test.add, in: {a: s.both, b: f}}\n  d: {uses: test.add, in: {a: c, b: g.a}}\n",
          "d: d, h: h");
  EXPECT_FALSE(result.failed());
  EXPECT_EQ(record(result, "g").reason, "it is called for each side of 'f', but node 'f' failed");
  EXPECT_EQ(result_of(result), 5);
  EXPECT_EQ(number_of(output(result, 1).items[1]), 20) << "s says which items there are";
}

TEST_F(MayFailTest, StoppedCountsMoreThanFailedAlone) {
  const auto status_of = [](const std::vector<Status>& calls) {
    std::vector<Call> all(calls.size());
    for (std::size_t i = 0; i < calls.size(); ++i) all[i].result.status = calls[i];
    NodeRecord record;
    set_status(all, record);
    return record.status;
  };
  EXPECT_EQ(status_of({Status::failed_alone, Status::cancelled}), Status::cancelled);
  EXPECT_EQ(status_of({Status::cancelled, Status::failed_alone}), Status::cancelled);
  EXPECT_EQ(status_of({Status::failed_alone, Status::not_run}), Status::not_run);
  EXPECT_EQ(status_of({Status::skipped, Status::failed_alone, Status::done}), Status::failed_alone);
}

TEST_F(MayFailTest, StoppedByAPersonIsNoFailure) {
  std::atomic<bool> stop{true};
  settings.cancelled = &stop;
  const RunResult result = run(kNumbers + kFails, "f: f");
  EXPECT_TRUE(result.cancelled());
  EXPECT_EQ(record(result, "f").status, Status::cancelled);
}

class MayFailText : public pipeline_fixture::PipelineTest {
 protected:
  /// The fault of the last node, in the line below those of kNumbers and f.
  void expect_refusal(const std::string& fails, const std::string& user, int column, const std::string& message,
                      const std::string& hint) {
    expect_fault("marrow: 1\nnodes:\n" + kNumbers + fails + user + "outputs: {n: n}\n", 6, column, message, hint);
  }
};

TEST_F(MayFailText, WhoNeedsItIsRefused) {
  expect_refusal(kFails, "  n: {uses: test.add, in: {a: f}}\n", 28, "node 'n' needs input 'a', but node 'f' may fail",
                 "write  may_fail: true  at node 'n' too, or wire it to an input that may be left out");
  expect_refusal(kFails, "  n: {uses: test.sum, in: {items: [c, f]}}\n", 39,
                 "node 'n' needs input 'items', but node 'f' may fail", "may_fail: true");
  expect_refusal(kFailsForB, "  n: {uses: test.sum, in: {items: f}}\n", 28,
                 "node 'n' needs input 'items', but node 'f' may fail", "may_fail: true");
  expect_refusal(kFailsForB, "  n: {uses: test.add, in: {a: c, b: f}}\n", 34,
                 "node 'n' is called for each side of 'f', but node 'f' may fail",
                 "write  may_fail: true  at node 'n' too");
  read("marrow: 1\nnodes:\n" + kNumbers + kFailsForB + "  n: {uses: test.add, in: {a: s.both, b: f}}\n" +
       "  m: {uses: test.add, in: {a: c, b: f.a}}\noutputs: {n: n, m: m}\n");
  EXPECT_TRUE(diagnostics.empty()) << diagnostics.text();
  expect_node_fault("{uses: test.constant, may_fail: perhaps}", 28,
                    "'may_fail' of node 'n': expected true or false, got 'perhaps'");
  expect_node_fault("{uses: test.constant, may_fial: true}", 28, "unknown key 'may_fial'", "did you mean 'may_fail'?");
}

TEST_F(MayFailText, ResolvedYamlAndOverrides) {
  const std::string nodes = kNumbers + kFails + "  d: {uses: test.add, in: {a: c, b: f}}\n";
  const std::string text = "marrow: 1\nnodes:\n" + nodes + "outputs: {d: d}\n";
  const std::string once = resolved_yaml(read(text));
  EXPECT_NE(once.find("may_fail: true"), std::string::npos) << once;
  EXPECT_EQ(resolved_yaml(read(once)), once);
  ASSERT_TRUE(diagnostics.empty()) << diagnostics.text();
  const auto may_fail = [&](const std::string& key, const std::string& value, std::size_t node) {
    const Pipeline pipeline = read(text, {{}, {{key, value}}});
    EXPECT_TRUE(diagnostics.empty()) << diagnostics.text();
    return !pipeline.nodes.empty() && pipeline.nodes[node].may_fail;
  };
  EXPECT_TRUE(may_fail("d.may_fail", "true", 3));
  EXPECT_FALSE(may_fail("f.may_fail", "false", 2));
  EXPECT_TRUE(may_fail("f.uses", "test.add", 2)) << "whatever takes the node's place";
  expect_fault(text, 0, 0, "'may_fail' of node 'f': expected true or false, got 'so'", "",
               {{}, {{"f.may_fail", "so"}}});
  expect_fault(text, 0, 0,
               "an override is node.option=value, node.uses=kind.name, node.may_fail=true or node.in.port=reference",
               "", {{}, {{"f", "true"}}});
}

}  // namespace may_fail_test
