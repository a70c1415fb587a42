// SPDX-License-Identifier: Apache-2.0
// Pipelines that extend others, and files of settings.

#include "tests/framework/pipeline/pipeline_fixture.hpp"

namespace extends_test {

using marrow::Pipeline;

const std::string kBase =
    "help: adds\ninputs: {v: {type: number, default: 3}}\nnodes:\n"
    "  c: {uses: test.constant, with: {value: $v, word: two}}\n  d: {uses: test.constant, with: {value: 4}}\n"
    "  sum: {uses: test.add, in: {a: c, b: d}}\noutputs: {sum: sum, c: c}\n";

class ExtendsTest : public pipeline_fixture::LayersTest {};

TEST_F(ExtendsTest, NothingElseIsTheSamePipelineWithItsOwnName) {
  const Pipeline p = good(extend(kBase, ""));
  EXPECT_EQ(p.name, "p");
  EXPECT_EQ(p.help, "adds");
  const Pipeline base = good(marrow::read_pipeline(scratch.path / "base.yaml", {}, catalogue(), diagnostics));
  Pipeline same = p;
  same.name = base.name;
  EXPECT_EQ(marrow::resolved_yaml(same), marrow::resolved_yaml(base));
  ASSERT_EQ(p.files.size(), 2u);
  EXPECT_EQ(p.files[1].filename(), "base.yaml");
}

TEST_F(ExtendsTest, OptionsWiresAndOutputsMerge) {
  const Pipeline p = good(extend(kBase,
                                 "name: mine\nhelp: other\nnodes:\n  c: {with: {value: 7}}\n  e: {uses: test.draw}\n"
                                 "  sum: {in: {b: e}}\noutputs: {c: null, e: e}\n"));
  EXPECT_EQ(p.name, "mine");
  EXPECT_EQ(p.help, "other");
  EXPECT_EQ(number(p, "c"), 7);
  EXPECT_EQ(std::get<std::string>(option(p, "c", "word")), "two");
  EXPECT_EQ(wires(p, "sum"), "a <- c, b <- e");
  ASSERT_EQ(p.outputs.size(), 2u);
  EXPECT_EQ(p.outputs[0].name, "sum");
  EXPECT_EQ(p.outputs[1].name, "e");
}

TEST_F(ExtendsTest, NullRemoves) {
  const Pipeline p = good(extend(kBase, "nodes:\n  c: {with: {value: null}}\n  d: null\n  sum: {in: {b: c}}\n"));
  EXPECT_EQ(number(p, "c"), 1) << "its default";
  EXPECT_EQ(ids(p), "c sum");
}

TEST_F(ExtendsTest, SetIsTheShortForm) {
  const Pipeline p = good(extend(kBase, "set: {c.value: 8, c.word: null, sum.in.b: c, d.uses: test.draw}\n"));
  EXPECT_EQ(number(p, "c"), 8);
  EXPECT_EQ(std::get<std::string>(option(p, "c", "word")), "one");
  EXPECT_EQ(wires(p, "sum"), "a <- c, b <- c");
  EXPECT_EQ(node(p, "d").info.name, "test.draw");
  EXPECT_EQ(p.notes, std::vector<std::string>{"nothing uses the input 'v'"}) << "its author knows that options go";
}

TEST_F(ExtendsTest, AnotherNodeGetsOnlyOptionsWrittenForIt) {
  Pipeline p = good(extend(kBase,
                           "nodes:\n  c: {uses: test.sides, with: {names: [x]}}\nset: {sum.in.a: c.left}\n"
                           "outputs: {c: c.left}\n"));
  EXPECT_EQ(std::get<std::vector<std::string>>(option(p, "c", "names")), std::vector<std::string>{"x"});
  p = good(extend(kBase, "set: {c.names: [x], c.uses: test.sides, sum.in.a: c.left}\noutputs: {c: c.left}\n"));
  EXPECT_EQ(std::get<std::vector<std::string>>(option(p, "c", "names")), std::vector<std::string>{"x"});
  p = good(extend(kBase, "nodes:\n  c: {uses: test.constant}\n"));
  EXPECT_EQ(number(p, "c"), 3) << "the same node keeps them";
}

TEST_F(ExtendsTest, SeveralFilesDeep) {
  scratch.write("ground.yaml", "marrow: 1\n" + kBase);
  const Pipeline p = good(extend("extends: ground.yaml\nset: {c.word: three, d.value: 5}\n", "set: {d.value: 6}\n"));
  EXPECT_EQ(number(p, "c"), 3);
  EXPECT_EQ(std::get<std::string>(option(p, "c", "word")), "three");
  EXPECT_EQ(number(p, "d"), 6);
  EXPECT_EQ(p.files.size(), 3u);
}

TEST_F(ExtendsTest, InputsChangeTheirDefaultOrGo) {
  EXPECT_EQ(number(good(extend(kBase, "inputs: {v: {default: 9}}\n")), "c"), 9);
  const std::string nodes = "inputs: {v: null, w: {type: number, default: 2}}\nset: {c.value: $w}\n";
  EXPECT_EQ(number(good(extend(kBase, nodes)), "c"), 2);
  extend(kBase, "inputs: {v: {default: much}}\n");
  expect_fault_in("p.yaml", 3, "input 'v': expected a number, got 'much'");
  extend(kBase, "inputs: {v: null}\n");
  expect_fault_in("base.yaml", 5, "the pipeline has no input 'v'");
  marrow::PipelineArguments arguments{{{"v", "5"}}, {}};
  EXPECT_EQ(number(good(extend(kBase, "inputs: {v: {default: 9}}\n", arguments)), "c"), 5);
}

TEST_F(ExtendsTest, PathsStartWhereTheyAreWritten) {
  std::filesystem::create_directory(scratch.path / "below");
  scratch.write("below/base.yaml",
                "marrow: 1\ninputs: {at: {type: path, default: a.txt}}\nnodes:\n"
                "  c: {uses: test.constant, with: {path: $at}}\n"
                "  d: {uses: test.constant, with: {path: a.txt}}\n"
                "  e: {uses: test.constant}\noutputs: {c: c, d: d, e: e}\n");
  const Pipeline p = good(read("marrow: 1\nextends: below/base.yaml\nset: {e.path: a.txt}\n"));
  const auto path = [&](const char* id) { return std::get<std::string>(option(p, id, "path")); };
  EXPECT_EQ(path("c"), (scratch.path / "below" / "a.txt").string());
  EXPECT_EQ(path("d"), (scratch.path / "below" / "a.txt").string());
  EXPECT_EQ(path("e"), (scratch.path / "a.txt").string());
}

TEST_F(ExtendsTest, BodiesAreChangedToo) {
  const std::string base =
      "nodes:\n  s: {uses: test.letters}\n  loop:\n    over: letter\n    in: {c: s}\n    repeat:\n      nodes:\n"
      "        c: {uses: test.constant}\n        d: {uses: test.constant}\n"
      "        sum: {uses: test.add, in: {a: c, b: d}}\n      outputs: {sum: sum}\noutputs: {o: loop.sum}\n";
  Pipeline p = good(extend(base, "nodes:\n  loop: {if_pass_fails: go_on, set: {d.value: 5}}\n"));
  EXPECT_TRUE(node(p, "loop").repetition->goes_on);
  EXPECT_EQ(number(node(p, "loop").repetition->alone, "d"), 5);
  p = good(extend(base, "set: {loop.body.d.value: 6}\n"));
  EXPECT_EQ(number(node(p, "loop").repetition->alone, "d"), 6);
}

TEST_F(ExtendsTest, OverridesComeLast) {
  marrow::PipelineArguments arguments{{}, {{"c.value", "1"}, {"c.uses", "test.constant"}}};
  EXPECT_EQ(number(good(extend(kBase, "set: {c.value: 8}\n", arguments)), "c"), 1);
  // The options of a file of settings belong to the node that it names.
  arguments = {{}, {{"c.names", "[x]", {}, 0}, {"c.uses", "test.sides", {}, 0}, {"c.uses", "test.constant", {}, 1}}};
  EXPECT_EQ(number(good(extend(kBase, "", arguments)), "c"), 1);
}

TEST_F(ExtendsTest, AnOverrideMayAddANode) {
  marrow::PipelineArguments arguments{{}, {{"sum.in.b", "new"}, {"new.value", "6"}, {"new.uses", "test.constant"}}};
  EXPECT_EQ(number(good(extend(kBase, "", arguments)), "new"), 6);
  extend(kBase, "", {{}, {{"summ.uses", "test.constant"}}});
  EXPECT_EQ(only_fault().message, "the pipeline has no node 'summ'");
  EXPECT_EQ(only_fault().hint, "did you mean 'sum'?; a node that is added must be wired to another, by  NODE.in.PORT");
}

TEST_F(ExtendsTest, FaultsOfExtends) {
  extend(kBase, "extends: other.yaml\n");
  expect_fault_in("p.yaml", 3, "'extends' is given twice in the pipeline", "the first is at line 2");
  read("marrow: 1\nextends: bse.yaml\n");
  expect_fault_in("p.yaml", 2, "there is no file 'bse.yaml' to extend", "did you mean 'base.yaml'?");
  read("marrow: 1\nextends: [base.yaml]\n");
  expect_fault_in("p.yaml", 2, "extends: expected a text, got a list of 1");
  extend("extends: p.yaml\n" + kBase, "");
  expect_fault_in("base.yaml", 2, "the files extend each other in a circle: p.yaml extends base.yaml extends p.yaml",
                  "one of them must stand alone");
  read("marrow: 1\nextends: p.yaml\n");
  expect_fault_in("p.yaml", 2, "the files extend each other in a circle: p.yaml extends p.yaml");
  for (int i = 1; i < 9; ++i)
    scratch.write("l" + std::to_string(i) + ".yaml", "marrow: 1\nextends: l" + std::to_string(i + 1) + ".yaml\n");
  scratch.write("l9.yaml", "marrow: 1\n" + kBase);
  read("marrow: 1\nextends: l1.yaml\n");
  expect_fault_in("l7.yaml", 2, "more than 8 files extend each other");
  good(read("marrow: 1\nextends: l3.yaml\n"));
}

TEST_F(ExtendsTest, FaultsAreShownInTheFileThatHasThem) {
  extend("nodes:\n  c: {uses: test.constant, with: {valu: 3}}\noutputs: {c: c}\n", "");
  expect_fault_in("base.yaml", 3, "'test.constant' has no option 'valu'", "did you mean 'value'?");
  extend(kBase, "nodes:\n  c: {with: {valu: 3}}\n");
  expect_fault_in("p.yaml", 4, "'test.constant' has no option 'valu'");
  extend(kBase, "nodes: {e: {with: {value: 3}}}\n");
  expect_fault_in("p.yaml", 3, "node 'e' does not say what it uses");
  extend(kBase, "set: {e.value: 3}\n");
  expect_fault_in("p.yaml", 3, "the pipeline has no node 'e'");
  extend(kBase, "set: {c: 3}\n");
  expect_fault_in("p.yaml", 3, "an override is node.option=value");
  extend(kBase, "set: [c.value]\n");
  expect_fault_in("p.yaml", 3, "set must be a map");
  extend("marrow: 2\n", "");
  EXPECT_GT(diagnostics.size(), 0u);
  extend(kBase, "nodes: {d: null}\n");
  expect_fault_in("base.yaml", 7, "there is no node 'd'");
}

TEST_F(ExtendsTest, VariablesOfTheEnvironment) {
  setenv("MARROW_TEST_VALUE", "12", 1);
  const std::string tail = "\noutputs: {c: c}\n";
  const std::string with = "marrow: 1\nnodes:\n  c: {uses: test.constant, with: {value: ";
  EXPECT_EQ(number(good(read(with + "'$env:MARROW_TEST_VALUE'}}" + tail)), "c"), 12);
  unsetenv("MARROW_TEST_VALUE");
  expect_fault(with + "'$env:MARROW_TEST_VALUE'}}" + tail, 3, 42, "the environment has no variable 'MARROW_TEST_VALUE'",
               "export MARROW_TEST_VALUE=...");
  expect_fault(with + "'$env:'}}" + tail, 3, 42, "$env: names no environment variable", "$env:NAME");
}

}  // namespace extends_test
