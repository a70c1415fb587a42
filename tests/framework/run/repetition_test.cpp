// SPDX-License-Identifier: Apache-2.0
// Nodes with a body: what the passes are given, what they carry, how they end.

#include "marrow/runtime/run/run_folder.hpp"
#include "tests/framework/store/store_fixture.hpp"

namespace repetition_test {

using namespace marrow;
using Status = NodeRecord::Status;

constexpr const char* kSum = R"(marrow: 1
nodes:
  before: {uses: test.constant, with: {value: 1}}
  item: {uses: test.constant, with: {value: 2}}
  sum: {uses: test.add, in: {a: before, b: item}}
outputs: {sum: sum}
)";

constexpr const char* kInput = "inputs: {amount: {type: number}}\n";

class RepetitionTest : public store_fixture::StoreTest {
 protected:
  RepetitionTest() { scratch.write("sum.yaml", kSum); }

  std::vector<double> numbers(const Value& list) {
    std::vector<double> result;
    for (const Value& item : list.items) result.push_back(item.is_absent() ? -1 : number_of(item));
    return result;
  }
  static const NodeRecord& of_body(const NodeRecord& record, std::size_t index) { return record.passes->nodes[index]; }

  std::string faults(const std::string& nodes, const std::string& outputs = "o: r") {
    Diagnostics diagnostics;
    read_pipeline(scratch.write("p.yaml", "marrow: 1\nnodes:\n" + nodes + "outputs: {" + outputs + "}\n"), {},
                  catalogue(), diagnostics);
    return diagnostics.text();
  }
};

constexpr const char* kOver =
    "  l: {uses: test.letters}\n"
    "  r: {repeat: sum.yaml, over: letter, in: {item: l}, carry: {before: sum}}\n";

TEST_F(RepetitionTest, CarriesFromItemToItem) {
  const RunResult result = run(kOver, "all: r.sum, last: r.last_sum");
  EXPECT_EQ(messages, "");
  EXPECT_EQ(output(result).axis, "letter");
  EXPECT_EQ(output(result).names, (std::vector<std::string>{"x", "y", "z"}));
  EXPECT_EQ(numbers(output(result)), (std::vector<double>{101, 301, 601}));
  EXPECT_EQ(result_of(result, 1), 601);
  const NodeRecord& node = record(result, "r");
  ASSERT_TRUE(node.passes);
  EXPECT_EQ(node.passes->passes.size(), 3u);
  EXPECT_EQ(node.calls, 3);
  EXPECT_EQ(of_body(node, 0).calls, 1) << "the body makes what is carried only before the first pass";
  EXPECT_EQ(of_body(node, 1).calls, 0) << "it is given";
  EXPECT_EQ(of_body(node, 2).calls, 3);
}

TEST_F(RepetitionTest, TheFirstValueCanBeGiven) {
  const RunResult result =
      run("  l: {uses: test.letters}\n  c: {uses: test.constant, with: {value: 7}}\n"
          "  r: {repeat: sum.yaml, over: letter, in: {item: l, before: c}, carry: {before: sum}}\n",
          "all: r.sum");
  EXPECT_EQ(numbers(output(result)), (std::vector<double>{107, 307, 607}));
}

TEST_F(RepetitionTest, ASecondRunCallsNothing) {
  run(kOver, "all: r.sum");
  const RunResult again = run(kOver, "all: r.sum");
  EXPECT_EQ(numbers(output(again)), (std::vector<double>{101, 301, 601}));
  EXPECT_EQ(of_body(record(again, "r"), 2).calls, 0);
  EXPECT_EQ(of_body(record(again, "r"), 2).cached, 3);
  const std::vector<PlannedNode> planned = plan(kOver, "all: r.sum");
  EXPECT_EQ(planned[1].what, PlannedNode::What::cached);
}

TEST_F(RepetitionTest, OneItemMoreIsOnePassMore) {
  const auto nodes = [](const std::string& names) {
    return "  s: {uses: test.sides, with: {names: [" + names + "]}}\n" +
           "  r: {repeat: sum.yaml, over: side, in: {item: s.both}, carry: {before: sum}}\n";
  };
  run(nodes("a, b"), "all: r.sum");
  const std::vector<PlannedNode> planned = plan(nodes("a, b, c"), "all: r.sum");
  const RunResult result = run(nodes("a, b, c"), "all: r.sum");
  EXPECT_EQ(numbers(output(result)), (std::vector<double>{11, 31, 61}));
  EXPECT_EQ(of_body(record(result, "r"), 2).calls, 1);
  EXPECT_EQ(of_body(record(result, "r"), 2).cached, 2);
}

TEST_F(RepetitionTest, ALoopEndsByItsRuleOrItsLimit) {
  const std::string body =
      "    repeat:\n"
      "      nodes:\n"
      "        number: {uses: test.constant, with: {value: 3}}\n"
      "        twice: {uses: test.add, in: {a: number, b: number}}\n"
      "        enough: {uses: test.stop_above, in: {a: twice}, with: {value: 20}}\n"
      "      outputs: {number: twice, done: enough}\n"
      "    carry: {number: number}\n    until: done\n";
  const RunResult result = run("  r:\n" + body + "    at_most: 9\n", "all: r.number, last: r.last_number");
  EXPECT_EQ(numbers(output(result)), (std::vector<double>{6, 12, 24}));
  EXPECT_EQ(output(result).axis, "pass");
  EXPECT_EQ(output(result).names, (std::vector<std::string>{"1", "2", "3"}));
  EXPECT_EQ(result_of(result, 1), 24);
  EXPECT_EQ(record(result, "r").passes->end, "it is above 20");
  const RunResult shorter = run("  r:\n" + body + "    at_most: 2\n", "last: r.last_number");
  EXPECT_EQ(result_of(shorter), 12);
  EXPECT_EQ(record(shorter, "r").passes->end, "there were 2 passes, which is the limit");
}

TEST_F(RepetitionTest, AFailedPassEndsTheNodeOrIsLeftOut) {
  scratch.write("limited.yaml", R"(marrow: 1
nodes:
  before: {uses: test.constant, with: {value: 0}}
  item: {uses: test.constant}
  good: {uses: test.fail_above, in: {a: item}, with: {value: 150}}
  sum: {uses: test.add, in: {a: before, b: good}}
outputs: {sum: sum}
)");
  const std::string nodes =
      "  s: {uses: test.sides, with: {names: [a, b]}}\n  l: {uses: test.letters}\n"
      "  r: {repeat: limited.yaml, over: letter, in: {item: l}, carry: {before: sum}";
  const RunResult ended = run(nodes + "}\n", "all: r.sum");
  EXPECT_TRUE(ended.failed());
  EXPECT_NE(messages.find("pass y failed: "), std::string::npos) << messages;
  EXPECT_EQ(record(ended, "r").passes->passes.size(), 2u);
  messages.clear();
  const RunResult result = run(nodes + ", if_pass_fails: go_on}\n", "all: r.sum, last: r.last_sum");
  EXPECT_FALSE(result.failed()) << messages;
  EXPECT_EQ(numbers(output(result)), (std::vector<double>{100, -1, -1}));
  EXPECT_EQ(result_of(result, 1), 100);
  EXPECT_EQ(record(result, "r").passes->passes[1].status, Status::failed);
}

TEST_F(RepetitionTest, WhatIsTheSameInAllPassesIsMadeOnce) {
  scratch.write("constant.yaml", R"(marrow: 1
nodes:
  amount: {uses: test.constant, with: {value: 5}}
  adder: {uses: test.adder, in: {amount: amount}}
  item: {uses: test.constant}
  sum: {uses: test.apply, in: {adder: adder, to: item}}
outputs: {sum: sum}
)");
  const std::string nodes = "  l: {uses: test.letters}\n  r: {repeat: constant.yaml, over: letter, in: {item: l}}\n";
  const RunResult result = run(nodes, "all: r.sum");
  EXPECT_EQ(numbers(output(result)), (std::vector<double>{105, 205, 305}));
  EXPECT_EQ(of_body(record(result, "r"), 0).calls, 1);
  EXPECT_EQ(of_body(record(result, "r"), 1).calls, 1) << "a function, too";
  EXPECT_EQ(of_body(record(result, "r"), 3).calls, 3);
}

TEST_F(RepetitionTest, BodiesNest) {
  scratch.write("outer.yaml", R"(marrow: 1
nodes:
  item: {uses: test.constant}
  l: {uses: test.sides}
  inner: {repeat: sum.yaml, over: side, in: {item: l.both, before: item}, carry: {before: sum}}
outputs: {total: inner.last_sum}
)");
  const RunResult result =
      run("  l: {uses: test.letters}\n  r: {repeat: outer.yaml, over: letter, in: {item: l}}\n", "all: r.total");
  EXPECT_EQ(numbers(output(result)), (std::vector<double>{130, 230, 330}));
  const NodeRecord& inner = of_body(record(result, "r"), 2);
  ASSERT_TRUE(inner.passes);
  std::vector<std::string> names;
  for (const auto& pass : inner.passes->passes) names.push_back(pass.name);
  EXPECT_EQ(names, (std::vector<std::string>{"x/a", "x/b", "y/a", "y/b", "z/a", "z/b"}));
  EXPECT_EQ(of_body(inner, 2).calls, 6);
}

TEST_F(RepetitionTest, OnePassCarriesNothing) {
  const RunResult result =
      run("  c: {uses: test.constant, with: {value: 7}}\n"
          "  r: {repeat: sum.yaml, at_most: 1, in: {item: c}}\n",
          "one: r.sum, last: r.last_sum");
  EXPECT_EQ(messages, "");
  EXPECT_EQ(output(result).axis, "once");
  EXPECT_EQ(numbers(output(result)), (std::vector<double>{8}));
  EXPECT_EQ(result_of(result, 1), 8);
}

TEST_F(RepetitionTest, OnePassMayHoldALoop) {
  scratch.write("two.yaml", std::string(kSum).replace(std::string(kSum).find("outputs:"), std::string::npos,
                                                      "  more: {uses: test.add, in: {a: sum, b: item}}\n"
                                                      "outputs: {sum: sum, more: more}\n"));
  scratch.write("loop.yaml",
                "marrow: 1\nnodes:\n  r: {repeat: two.yaml, at_most: 3, carry: {before: sum}}\n"
                "outputs: {all: r.sum, last: r.last_sum, more: r.more, end: r.last_more}\n");
  const RunResult result = run("  o: {repeat: loop.yaml, at_most: 1}\n",
                               "all: o.last_all, last: o.last_last, more: o.last_more, end: o.last_end");
  EXPECT_EQ(messages, "");
  EXPECT_EQ(output(result).axis, "pass");
  EXPECT_EQ(numbers(output(result)), (std::vector<double>{3, 5, 7}));
  EXPECT_EQ(result_of(result, 1), 7);
  EXPECT_EQ(numbers(output(result, 2)), (std::vector<double>{5, 7, 9}));
  ASSERT_FALSE(output(result, 3).is_absent()) << "the loop makes all that the pass gives out";
  EXPECT_EQ(result_of(result, 3), 9);
  EXPECT_EQ(record(result, "o").passes->end, "there was one pass, which is the limit");
}

TEST_F(RepetitionTest, OverridesReachIntoTheBody) {
  Diagnostics diagnostics;
  PipelineArguments arguments;
  arguments.overrides = {{"r.body.before.value", "40"}};
  const auto file = scratch.write("p.yaml", std::string("marrow: 1\nnodes:\n") + kOver + "outputs: {all: r.sum}\n");
  pipeline = read_pipeline(file, arguments, catalogue(), diagnostics);
  ASSERT_TRUE(diagnostics.empty()) << diagnostics.text();
  settings.store = nullptr;
  EXPECT_EQ(numbers(output(run_pipeline(pipeline, catalogue(), settings))), (std::vector<double>{140, 340, 640}));
  const auto resolved = scratch.write("resolved.yaml", resolved_yaml(pipeline));
  pipeline = read_pipeline(resolved, {}, catalogue(), diagnostics);
  ASSERT_TRUE(diagnostics.empty()) << diagnostics.text() << resolved_yaml(pipeline);
  EXPECT_EQ(numbers(output(run_pipeline(pipeline, catalogue(), settings))), (std::vector<double>{140, 340, 640}));
}

TEST_F(RepetitionTest, FaultsAreFoundBeforeAnythingRuns) {
  const std::string letters = "  l: {uses: test.letters}\n";
  const auto expect = [&](const std::string& node, const std::string& fault) {
    const std::string found = faults(letters + "  r: {" + node + "}\n", "o: r.sum");
    EXPECT_NE(found.find(fault), std::string::npos) << node << "\n" << found;
  };
  expect("repeat: sum.yaml, carry: {before: sum}", "node 'r' may never end: it goes over no axis and has no limit");
  expect("repeat: sum.yaml, over: letter, in: {itme: l}", "there is no node 'itme'");
  expect("repeat: sum.yaml, over: letter, in: {item: l}, carry: {before: sums}", "the body has no output 'sums'");
  expect("repeat: sum.yaml, over: side, in: {item: l}",
         "'item' of the body is one item, but 'l' is a list over letter");
  expect("repeat: sum.yaml, at_most: 3", "carries nothing from pass to pass");
  scratch.write("twice.yaml", std::string(kSum).replace(std::string(kSum).find("{sum: sum}"), std::string::npos,
                                                        "{sum: sum, last_sum: sum}\n"));
  expect("repeat: twice.yaml, at_most: 3, carry: {before: sum}", "the body has the outputs 'sum' and 'last_sum'");
  expect("repeat: twice.yaml, at_most: 3, carry: {before: sum}",
         "'last_sum' is already the name of the last 'sum'; rename one of them");
  expect("repeat: sum.yaml, at_most: 3, carry: {before: sum}, until: sum", "'until' must name one value of type stop");
  expect("repeat: sum.yaml, at_most: 0, carry: {before: sum}", "must be a number of passes from 1 to 1000000");
  expect("repeat: none.yaml, over: letter, in: {item: l}", "none.yaml");
  expect("uses: test.letters, repeat: sum.yaml, over: letter", "has both 'uses' and a body");
  expect("repeat: p.yaml, over: letter, in: {l: l}", "repeats itself");
  expect("repeat: sum.yaml, over: letter, in: {item: l}, if_pass_fails: goon", "must be end or go_on");
}

TEST_F(RepetitionTest, AnInputWithoutAValueIsNoFaultOfTheBody) {
  std::string body = kSum;
  body.replace(body.find("value: 1"), 8, "value: $amount").insert(body.find("nodes:"), kInput);
  scratch.write("sum.yaml", body);
  std::string outer = std::string("marrow: 1\n") + kInput + "nodes:\n" + kOver + "outputs: {all: r.sum}\n";
  outer.insert(outer.find("in: {item"), "with: {amount: $amount}, ");
  Diagnostics diagnostics;
  read_pipeline(scratch.write("p.yaml", outer), {}, catalogue(), diagnostics, false);
  EXPECT_EQ(diagnostics.text(), "") << "checked before it has its data";
}

TEST_F(RepetitionTest, WhatIsTheSameInAllPassesMustSucceed) {
  scratch.write("constant.yaml", R"(marrow: 1
nodes:
  amount: {uses: test.constant, with: {value: 5}}
  good: {uses: test.fail_above, in: {a: amount}, with: {value: 1}}
  item: {uses: test.constant}
  sum: {uses: test.add, in: {a: good, b: item}}
outputs: {sum: sum}
)");
  const RunResult result =
      run("  l: {uses: test.letters}\n"
          "  r: {repeat: constant.yaml, over: letter, in: {item: l}, if_pass_fails: go_on}\n",
          "all: r.sum");
  EXPECT_TRUE(result.failed());
  EXPECT_EQ(record(result, "r").reason, "node 'good' of the body failed: the number is too large; give a smaller one");
}

TEST_F(RepetitionTest, OneThreadAndTwoGiveTheSame) {
  settings.store = nullptr;
  std::vector<std::vector<double>> all;
  for (const int threads : {1, 2, 4}) {
    read(kOver, "all: r.sum");
    settings.threads = threads;
    all.push_back(numbers(output(run_pipeline(pipeline, catalogue(), settings))));
  }
  EXPECT_EQ(all[0], all[1]);
  EXPECT_EQ(all[0], all[2]);
}

}  // namespace repetition_test
