// SPDX-License-Identifier: Apache-2.0
// Harmful pipeline files: names that lead to other folders, and texts that are long, deep or slow to read.
#include <ctime>

#include "tests/framework/pipeline/pipeline_fixture.hpp"

namespace hostile_pipelines_test {

using marrow::Diagnostics;
using marrow::Pipeline;
using pipeline_fixture::PipelineTest;
using runtime_fixture::test_catalogue;

/// A pipeline of one node with a key before it.
std::string with_key(const std::string& key) {
  return "marrow: 1\n" + key + "\nnodes:\n  c: {uses: test.constant}\noutputs: {o: c}\n";
}

TEST_F(PipelineTest, NameIsNoPath) {
  const std::string start = "a pipeline's name becomes a file name: ";
  expect_fault(with_key("name: ../../x"), 2, 1, start + "'../../x' cannot be one, it holds '/'",
               "use at most 100 letters");
  expect_fault(with_key("name: .."), 2, 1, start + "'..' cannot be one, it begins with a dot",
               "use at most 100 letters");
  expect_fault(with_key("name: ''"), 2, 1, start + "'' cannot be one, it is empty");
  expect_fault(with_key("name: \"a\\e[2J\""), 2, 1, "it holds a control character");
  expect_fault(with_key("name: " + std::string(101, 'x')), 2, 1, "it has 101 bytes");
  EXPECT_EQ(read(with_key("name: größer, links (2)")).name, "größer, links (2)");
  EXPECT_TRUE(diagnostics.empty()) << diagnostics.text();
}

TEST_F(PipelineTest, NameIsNoPathAndOfOutputsAFileName) {
  for (const std::string& file :
       {std::string("...yaml"), std::string(".yaml"), std::string("a\nb.yaml"), std::string(120, 'x') + ".yaml"}) {
    diagnostics = Diagnostics();
    marrow::read_pipeline(scratch.write(file, with_key("help: x")), {}, test_catalogue(), diagnostics);
    expect_shown("the pipeline takes its name from its file, and '");
    expect_shown("hint: add  name: ...");
    marrow::read_pipeline(scratch.write(file, with_key("name: x")), {}, test_catalogue(), diagnostics = Diagnostics());
    EXPECT_TRUE(diagnostics.empty()) << diagnostics.text();
  }
  for (const char* name : {"a/b", "..", ".a", "' a'", "'a '", "'a\\b'"})
    expect_fault("marrow: 1\nnodes:\n  c: {uses: test.constant}\noutputs:\n  " + std::string(name) + ": c\n", 5, 3,
                 "an output's name becomes a file name: '", "use at most");
}

TEST_F(PipelineTest, ControlCharactersInKeysAndTooLongAFile) {
  expect_fault(
      "marrow: 1\nnodes:\n  \"a\\e[31m\": {uses: test.constant}\n  c: {uses: test.constant}\noutputs: {o: c}\n", 3, 3,
      "in nodes holds a control character", "write it without");
  expect_fault("marrow: 1\nnodes:\n  c: {uses: test.constant}\noutputs: {o: c, \"a\\nb\": c}\n", 4, 17,
               "in outputs holds a control character");
  EXPECT_EQ(diagnostics.text().find('\x1b'), std::string::npos);
  read(with_key("#" + std::string(4000000, 'x')));
  expect_shown("the pipeline file is longer than 4 MB");
}

TEST_F(PipelineTest, DeepNestingIsSaid) {
  for (const std::string& open : {std::string("["), std::string("{a: "), std::string("- "), std::string("? ")}) {
    std::string deep = "a:\n  ";
    for (int i = 0; i < 60000; ++i) deep += open;
    read(deep);
    expect_shown("lists and maps are nested more than 100 deep");
  }
  expect_fault(with_key("help: " + std::string(50, '[') + std::string(50, ']')), 2, 1,
               "help: expected a text, got a list");
}

TEST_F(PipelineTest, AliasesThatMultiplyAreSaid) {
  std::string bomb = "a0: &a0 [x, x, x, x, x, x, x, x, x, x]\n";
  for (int i = 1; i < 30; ++i) {
    bomb += "a" + std::to_string(i) + ": &a" + std::to_string(i) + " [";
    for (int k = 0; k < 10; ++k) bomb += (k ? ", *a" : "*a") + std::to_string(i - 1);
    bomb += "]\n";
  }
  read(bomb);
  expect_shown("aliases repeat more than 100000 values");
  read("marrow: 1\nnodes: &a {b: *a}\n");
  EXPECT_HAS(diagnostics.text(),
             "p.yaml:2:15: error: cannot be read as YAML: an alias names the list or map that contains it");
  const Pipeline p = read_good(
      "marrow: 1\nnodes:\n  c: {uses: test.constant, with: &options {value: 7}}\n  d: {uses: test.constant, with: "
      "*options}\noutputs: {o: c, p: d}\n");
  EXPECT_EQ(std::get<double>(p.nodes[1].options[0]), 7.0) << "aliases are good for something";
}

TEST_F(PipelineTest, SecondDocumentNulAndInputsThatMultiplyAreSaid) {
  expect_fault(with_key("help: x") + "---\nmarrow: 1\n", 6, 1, "the file goes on after the end of its first document");
  expect_fault(with_key("help: \"a\\0b\""), 2, 7, "a text holds the character NUL (\\0); take it out");
  read_good(with_key("help: x") + "...\n# the end\n");
  std::string names;
  for (int i = 0; i < 20; ++i) names += "$a";
  read("marrow: 1\ninputs: {a: {type: text, default: " + std::string(20000, 'x') +
       "}}\nnodes:\n  s: {uses: test.sides, with: {names: [" + names + "]}}\noutputs: {o: s.left}\n");
  expect_shown("the values of inputs make the pipeline longer than 256 kB");
  EXPECT_LT(diagnostics.text().size(), 1000u);
}

/// Files of 64 kB that are as slow to read as they can be.
TEST_F(PipelineTest, SmallFilesTakeNoTime) {
  const auto many = [](const std::function<std::string(const std::string& number)>& part) {
    std::string text;
    for (int i = 0; text.size() < 63000; ++i) text += part(std::to_string(i));
    return text;
  };
  const auto repeated = [&](const std::string& part) { return many([&](const std::string&) { return part; }); };
  const std::string head = "marrow: 1\nnodes:\n", constant = " c: {uses: test.constant}\n",
                    numbers = head + " c: {uses: test.constant, with: {numbers: [";
  std::string reverse = head;
  for (int i = 0; i < 1500; ++i)
    reverse += " n" + std::to_string(i) + ": {uses: test.add, in: {a: n" + std::to_string(i + 1) + "}}\n";
  const std::map<std::string, std::string> files{
      {"in reverse order", reverse + " n1500: {uses: test.constant}\noutputs: {o: n0}\n"},
      {"unknown nodes",
       head + many([](const auto& i) { return " n" + i + ": {uses: t" + i + "}\n"; }) + "outputs: {o: n0}\n"},
      {"unknown sources", head + " c: {uses: test.sum, in: {items: [" +
                              many([](const auto& i) { return "m" + i + ", "; }) + "c]}}\noutputs: {o: c}\n"},
      {"unknown among many", head + many([](const auto& i) {
                               return " n" + i + ": {uses: test.add, in: {a: m" + i + "}}\n";
                             }) + "outputs: {o: n0}\n"},
      {"many wires",
       head + constant + " s: {uses: test.sum, in: {items: [" + repeated("c,") + "c]}}\noutputs: {o: s}\n"},
      {"unknown keys", head + constant + "outputs: {o: c}\n" + many([](const auto& i) { return "n" + i + ":\n"; })},
      {"the same key", head + repeated(" c: {}\n") + "outputs: {o: c}\n"},
      {"numbers", numbers + repeated("1,") + "1]}}\noutputs: {o: c}\n"},
      {"no numbers", numbers + repeated("x,") + "1]}}\noutputs: {o: c}\n"},
      {"outputs", head + constant + "outputs:\n" + many([](const auto& i) { return " n" + i + ": c\n"; })},
      {"inputs", "marrow: 1\ninputs:\n" + many([](const auto& i) { return " n" + i + ": {type: path}\n"; }) +
                     "nodes: {c: {uses: test.constant}}\noutputs: {o: c}\n"},
      {"unknown inputs", head + " c: {uses: test.constant, with: {path: " + many([](const auto& i) {
                           return "$i" + i;
                         }) + "}}\noutputs: {o: c}\n"},
      {"dots", head + constant + "outputs: {o: c" + std::string(63000, '.') + "}\n"},
      {"a long name", head + " c: {uses: " + std::string(63000, 'x') + "}\noutputs: {o: c}\n"}};
  for (const auto& [what, text] : files) {
    const std::clock_t start = std::clock();
    read(text);
    const std::string shown = diagnostics.text();
    std::printf("%-20s %.3f s, %zu faults\n", what.c_str(), double(std::clock() - start) / CLOCKS_PER_SEC,
                diagnostics.size());
    EXPECT_LT(double(std::clock() - start) / CLOCKS_PER_SEC, 20) << what;
    EXPECT_LT(shown.size(), 200000u) << what;
  }
}

}  // namespace hostile_pipelines_test
