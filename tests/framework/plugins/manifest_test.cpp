// SPDX-License-Identifier: Apache-2.0
// Manifests whose checksum is right, because anyone can compute it, but whose content no library can have registered.
#include "marrow/runtime/plugins/manifest.hpp"

#include <random>

#include "tests/framework/fixture.hpp"

namespace manifest_test {

using marrow::OptionType;
using nlohmann::json;

marrow::OptionInfo option(const std::string& name, OptionType type, marrow::OptionValue value) {
  marrow::OptionInfo info;
  info.name = name;
  info.help = "an option";
  info.type = type;
  info.default_value = std::move(value);
  return info;
}

marrow::TypeInfo type(const std::string& id, std::size_t size, bool is_function) {
  marrow::TypeInfo info;
  info.id = id;
  info.version = 1;
  info.size = size;
  info.is_function = is_function;
  return info;
}

marrow::PortInfo port(const std::string& name, const marrow::TypeInfo& type, const std::string& axis) {
  marrow::PortInfo info;
  info.name = name;
  info.help = "a port";
  info.type = type;
  info.optional = !axis.empty();
  info.axis = axis;
  return info;
}

marrow::LibraryInfo library() {
  marrow::LibraryInfo info;
  info.digest = {1, 2};
  info.linked = {{"/usr/lib/libthis.so.1", 12345}, {"/plugins/caf\xe9/libthat.so", 7}};  // a name that is not UTF-8
  marrow::NodeInfo node;
  node.name = "test.all";
  node.summary = "Has an option of each type";
  node.random = true;
  node.inputs = {port("a", type("metrics", 24, false), ""), port("b", type("metrics", 24, false), "view")};
  node.outputs = {port("c", type("cost", 8, true), "")};
  node.options = {option("boolean", OptionType::boolean, true),
                  option("integer", OptionType::integer, std::int64_t(-3)),
                  option("number", OptionType::number, 0.5),
                  option("text", OptionType::text, std::string("one")),
                  option("path", OptionType::path, std::string()),
                  option("numbers", OptionType::numbers, std::vector<double>{1, 2, 3}),
                  option("texts", OptionType::texts, std::vector<std::string>{"x", "y"}),
                  option("paths", OptionType::paths, std::vector<std::string>{})};
  node.options[2].minimum = 0;
  node.options[2].maximum = 1;
  node.options[3].choices = {"one", "two"};
  node.options[5].length = 3;
  node.options[4].beside = {".onnx"};
  node.options[6].replaces = {"texts", "words"};
  node.relations = {{marrow::RelationType::not_above, {"integer", "number"}},
                    {marrow::RelationType::same_length, {"numbers", "texts", "paths"}}};
  node.traits = {"fast"};
  info.nodes = {node};
  marrow::KindInfo kind;
  kind.name = "test";
  kind.summary = "has everything that a kind can have";
  kind.inputs = {{"a", "a port", {type("metrics", 24, false), type("mesh", 80, false)}, ""}};
  kind.outputs = {{"c", "a port", {type("cost", 8, true)}, "view"}};
  kind.sees_truth = true;
  kind.apart = marrow::Apart::computes;
  kind.traits = {{"fast", "takes no time"}};
  kind.checks = {{"bias", "how far off it is", 0.25, "mm"}};
  info.kinds = {kind};
  info.writers.resize(1);
  info.writers[0].type = type("mesh", 80, false);
  info.writers[0].extension = ".ply";
  return info;
}

/// The text of a document, with the checksum that makes it look untouched.
std::string sealed(json document) {
  if (!document.is_object()) return document.dump();
  document.erase("checksum");
  return marrow::with_checksum(document);
}

void expect_refused(const std::string& text, const std::string& reason) {
  const std::string said = marrow::test::message_of([&] { marrow::manifest_from_text(text); });
  EXPECT_NE(said.find(reason), std::string::npos) << said << " of " << text.substr(0, 300);
}

void expect_refused(const std::function<void(json&)>& invent, const std::string& reason) {
  json document = json::parse(marrow::manifest_text(library()));
  invent(document);
  expect_refused(sealed(document), reason);
}

/// What the rest of the program relies on when it uses a description.
void expect_consistent(const marrow::LibraryInfo& info) {
  const std::string text = marrow::manifest_text(info);
  ASSERT_EQ(marrow::manifest_text(marrow::manifest_from_text(text)), text);
  static constexpr std::size_t kIndex[] = {0, 1, 2, 3, 3, 4, 5, 5};
  for (const marrow::NodeInfo& node : info.nodes)
    for (const marrow::OptionInfo& one : node.options) {
      ASSERT_LE(int(one.type), int(OptionType::paths));
      ASSERT_EQ(one.default_value.index(), kIndex[int(one.type)]);
      ASSERT_TRUE(!one.length || std::get<std::vector<double>>(one.default_value).size() == one.length);
    }
}

TEST(Manifest, IsReadAsItWasWrittenWithADigestInHexadecimal) {
  const marrow::LibraryInfo info = library();
  EXPECT_EQ(marrow::difference(info, marrow::manifest_from_text(marrow::manifest_text(info))), "");
  expect_consistent(info);
  expect_refused([](json& j) { j["library"] = std::string(32, 'z'); },
                 "the library's digest is not 32 hexadecimal digits");
  expect_refused([](json& j) { j["library"] = "12"; }, "the library's digest is not 32 hexadecimal digits");
}
TEST(Manifest, IsShallowAndSmall) {
  expect_refused(std::string(1000000, '['), "nested more than 64 deep");
  expect_refused("{\"a\":" + std::string(100000, '[') + std::string(100000, ']') + "}", "nested more than 64 deep");
  expect_refused(std::string(5 << 20, ' '), "it is damaged: it has 5242880 bytes");
  expect_refused("", "it is damaged");
  expect_refused("[]", "it is damaged: it is not an object");
  expect_refused("{}", "it was written by another version of marrow");
  const std::string text = marrow::manifest_text(library());
  for (std::size_t size = 0; size + 2 < text.size(); size += 7)
    expect_refused(text.substr(0, size), "it is damaged: its text");
}
TEST(Manifest, EveryByteIsCovered) {
  const std::string text = marrow::manifest_text(library());
  expect_refused(text + " ", "it was edited by hand");
  expect_refused(" " + text, "it was edited by hand");
  json document = json::parse(text);
  expect_refused(document.dump(1), "it was edited by hand");
  document.erase("checksum");
  expect_refused(document.dump(), "it is damaged: it has no checksum");
}
TEST(Manifest, OptionTypesExistAndDefaultsHaveThem) {
  expect_refused([](json& j) { j["nodes"][0]["options"][0]["type"] = "quaternion"; },
                 "there is no type of options 'quaternion'");
  for (std::size_t i = 0; i < 8; ++i)
    for (const json& wrong : {json(), json::object(), json{1, "x"}})
      expect_refused([&](json& j) { j["nodes"][0]["options"][i]["default"] = wrong; }, "an option: 'default'");
  expect_refused([](json& j) { j["nodes"][0]["options"][0]["default"] = 1; }, "'default' is neither true nor false");
  expect_refused([](json& j) { j["nodes"][0]["options"][1]["default"] = 0.5; }, "'default': expected a whole number");
  expect_refused([](json& j) { j["nodes"][0]["options"][2]["default"] = true; }, "'default' is not a number");
}
TEST(Manifest, RangesAndLengthsFit) {
  const auto number = [](const char* key, json value) {
    return [=](json& j) { j["nodes"][0]["options"][2][key] = value; };
  };
  expect_refused(number("default", 7.0), "option 'number': its default is outside its own range");
  expect_refused(number("minimum", 2.0), "option 'number': its range is empty or not finite");
  expect_refused(number("minimum", "0"), "'minimum' is not a number");
  expect_refused(number("length", 3), "the default of 'number' does not have 3 numbers");
  const auto length = [](json value) { return [=](json& j) { j["nodes"][0]["options"][5]["length"] = value; }; };
  expect_refused(length(-1), "'length' is -1; expected a whole number from 0 to");
  expect_refused(length(std::uint64_t(1) << 63), "'length' is 9223372036854775808; expected a whole number from 0 to");
  expect_refused(length(1000000), "the default of 'numbers' does not have 1000000 numbers");
  expect_refused(length(2.5), "'length': expected a whole number");
  expect_refused([](json& j) { j["nodes"][0]["inputs"][0]["type"]["size"] = 0; },
                 "'size' is 0; expected a whole number from 1");
}
TEST(Manifest, NamesAndTextsAreThoseOfADeclaration) {
  expect_refused([](json& j) { j["nodes"][0]["name"] = "../../x"; }, "a node's name is kind.name in lower_case");
  expect_refused([](json& j) { j["nodes"][0]["summary"] = "\x1b[2J"; },
                 "summary: its texts must be UTF-8 without control characters");
  expect_refused(
      [](json& j) {
        j["nodes"][0]["options"][3]["choices"] = {"one", "a\nb"};
      },
      "option 'text': its texts must be UTF-8");
  expect_refused([](json& j) { j["nodes"].push_back(j["nodes"][0]); }, "it has the node 'test.all' twice");
  expect_refused([](json& j) { j["nodes"][0]["options"].push_back(j["nodes"][0]["options"][0]); },
                 "option 'boolean' is named twice");
  expect_refused([](json& j) { j["writers"][0]["extension"] = ".x/../../y"; },
                 "'.x/../../y' is not an extension of files");
  expect_refused([](json& j) { j["linked"][0]["path"] = "libthis.so.1"; },
                 "'libthis.so.1' is not the full path of a library");
  marrow::LibraryInfo many = library();
  many.linked.resize(20'000, many.linked[0]);
  expect_consistent(many);
  expect_refused([](json& j) { j["linked"] = std::vector<json>(20'001, j["linked"][0]); },
                 "it names more than 20000 linked libraries");
  expect_refused([](json& j) { j["linked"][0]["path"] = 7; }, "the path of a library: expected a text");
}
TEST(Manifest, KindsAreThoseOfADeclaration) {
  const auto kind = [](const char* key, json value) { return [=](json& j) { j["kinds"][0][key] = value; }; };
  expect_refused(kind("name", "a.b"), "kind a.b: a kind's name is lower_case, without a dot");
  expect_refused(kind("apart", "sometimes"), "there is no way to run apart 'sometimes'");
  expect_refused(kind("sees_truth", 1), "'sees_truth' is neither true nor false");
  expect_refused(kind("is_suite", 1), "'is_suite' is neither true nor false");
  expect_refused(kind("more", 1), "a kind has 10 fields, expected 9");
  expect_refused([](json& j) { j["kinds"][0]["inputs"][0]["types"] = json::array(); }, "input 'a': has no type");
  expect_refused([](json& j) { j["kinds"][0]["traits"].push_back(j["kinds"][0]["traits"][0]); },
                 "trait 'fast' is named twice");
  expect_refused([](json& j) { j["kinds"][0]["checks"][0]["limit"] = "none"; }, "'limit' is not a number");
  expect_refused([](json& j) { j["kinds"].push_back(j["kinds"][0]); }, "it has the kind 'test' twice");
}
TEST(Manifest, RelationsAreThoseOfADeclaration) {
  const auto names = [](json value) { return [=](json& j) { j["nodes"][0]["relations"][0]["names"] = value; }; };
  expect_refused(names({"integer", "nothing"}), "relation not_above: there is no option 'nothing'");
  expect_refused(names({"integer"}), "relation not_above: it needs two names");
  expect_refused(names({"integer", "number", "number"}), "relation not_above: it needs two names");
  expect_refused(names({"integer", "text"}), "relation not_above: option 'text' is not a number");
  expect_refused([](json& j) { j["nodes"][0]["relations"][0]["type"] = "like"; }, "there is no relation 'like'");
}
TEST(Manifest, HasAllFieldsAndNoOthers) {
  expect_refused([](json& j) { j["more"] = 1; }, "it has 8 fields, expected 7");
  expect_refused([](json& j) { j["nodes"][0].erase("random"); }, "a node has 7 fields, expected 8");
  expect_refused([](json& j) { j["nodes"] = "none"; }, "'nodes' is not a list");
  expect_refused([](json& j) { j["nodes"] = {1}; }, "a node is not an object");
  expect_refused([](json& j) { j["refused"] = "is bad"; }, "it has nodes of a library that it refuses");
}
TEST(Manifest, DifferencesAreNamed) {
  const auto expect = [](const std::function<void(marrow::LibraryInfo&)>& change, const std::string& reason) {
    marrow::LibraryInfo changed = library();
    change(changed);
    EXPECT_EQ(marrow::difference(changed, library()), reason);
  };
  expect([](auto& i) { i.nodes[0].random = false; },
         "nodes/test.all/random: the library has true, its description has false");
  expect([](auto& i) { i.nodes[0].options[2].maximum = 5; },
         "nodes/test.all/options/number/maximum: the library has 1.0, its description has 5.0");
  expect([](auto& i) { i.nodes[0].options[2].minimum.reset(); },
         "nodes/test.all/options/number/minimum: the library has 0.0, its description has none");
  expect([](auto& i) { i.nodes[0].inputs.pop_back(); },
         "nodes/test.all/inputs: the library has 2 of them, its description has 1 of them");
  expect([](auto& i) { i.nodes[0].name = "test.other"; },
         "nodes/test.other: the library has none, its description has it");
  expect([](auto& i) { i.nodes[0].traits = {}; },
         "nodes/test.all/traits: the library has 1 of them, its description has 0 of them");
  expect([](auto& i) { i.nodes[0].relations[0].type = marrow::RelationType::below; },
         "nodes/test.all/relations/1/type: the library has \"not_above\", its description has \"below\"");
  expect([](auto& i) { i.kinds[0].sees_truth = false; },
         "kinds/test/sees_truth: the library has true, its description has false");
  expect([](auto& i) { i.kinds[0].checks[0].limit = 9; },
         "kinds/test/checks/bias/limit: the library has 0.25, its description has 9.0");
  expect([](auto& i) { i.writers.push_back(i.writers[0]); },
         "its description has another order or number of kinds, nodes and writers");
}

/// All values of a document.
void collect(json& j, std::vector<json*>& all) {
  all.push_back(&j);
  if (j.is_structured())
    for (json& item : j) collect(item, all);
}

void mutate(json& document, std::mt19937& random) {
  static const std::vector<json> kValues{nullptr,   true,          0,
                                         -1,        1e300,         0.5,
                                         INT64_MAX, UINT64_MAX,    "",
                                         "x",       "number",      "numbers",
                                         "\x1b",    json::array(), json::object(),
                                         {1, 2, 3}, {"a"},         {{"name", "x"}}};
  std::vector<json*> all;
  collect(document, all);
  const auto pick = [&](std::size_t count) { return std::size_t(random()) % count; };
  json& one = *all[pick(all.size())];
  switch (pick(4)) {
    case 0:
      one = kValues[pick(kValues.size())];
      break;
    case 1:
      one = json(*all[pick(all.size())]);
      break;
    case 2:
      if (one.is_array() && !one.empty()) one.push_back(json(one[pick(one.size())]));
      break;
    default:
      if (one.is_structured() && !one.empty()) one.erase(std::next(one.begin(), std::ptrdiff_t(pick(one.size()))));
  }
}

TEST(Manifest, MutantsAreRefusedOrConsistent) {
  std::mt19937 random(1);
  const std::string text = marrow::manifest_text(library());
  int believed = 0;
  for (int i = 0; i < 5000; ++i) {
    std::string mutant = text;
    for (std::size_t flips = random() % 3; i % 2 && flips > 0; --flips)
      mutant[random() % mutant.size()] = char(random());
    json document = json::parse(mutant, nullptr, false);
    if (!document.is_discarded()) {
      for (std::size_t changes = 1 + random() % 2; changes > 0; --changes) mutate(document, random);
      mutant = sealed(document);
    }
    try {
      const marrow::LibraryInfo info = marrow::manifest_from_text(mutant);
      ++believed;
      expect_consistent(info);
    } catch (const marrow::Error&) {
    }
    if (HasFatalFailure()) FAIL() << mutant;
  }
  EXPECT_GT(believed, 50);
}

// Nodes against the contract of their kind.

using marrow::NodeInfo;
using marrow::TypeInfo;
using Faults = std::vector<std::string>;

marrow::KindInfo edges_kind() {
  marrow::KindInfo kind;
  kind.name = "edges";
  kind.inputs = {{"view", "", {TypeInfo::of<marrow::View>()}, ""}};
  kind.outputs = {{"edges", "", {TypeInfo::of<marrow::EdgeMap>(), TypeInfo::of<marrow::Picture>()}, ""}};
  kind.traits = {{"thin", "one pixel wide"}};
  return kind;
}

template <class In, class Out>
NodeInfo node(const std::string& in, const std::string& out) {
  NodeInfo info;
  info.name = "edges.mine";
  info.inputs = {{in, "", TypeInfo::of<In>(), false, ""}};
  info.outputs = {{out, "", TypeInfo::of<Out>(), false, ""}};
  return info;
}

Faults faults(const NodeInfo& info) {
  const marrow::KindInfo kind = edges_kind();
  return contract_faults(info, &kind);
}

TEST(Contract, WhatTheKindSaysAndOtherTypes) {
  EXPECT_EQ(faults(node<marrow::View, marrow::EdgeMap>("view", "edges")), Faults{});
  EXPECT_EQ(faults(node<marrow::View, marrow::Picture>("view", "edges")), Faults{}) << "the other of its two types";
  EXPECT_EQ(faults(node<marrow::Volume, marrow::EdgeMap>("view", "edges")),
            Faults{"input 'view': the kind 'edges' has it as view, not volume"});
  EXPECT_EQ(faults(node<marrow::View, marrow::Volume>("view", "edges")),
            Faults{"output 'edges': the kind 'edges' has it as edge_map or picture, not volume"});
  NodeInfo list = node<marrow::View, marrow::EdgeMap>("view", "edges");
  list.inputs[0].axis = "view";
  EXPECT_EQ(faults(list), Faults{"input 'view': the kind 'edges' has it as view, not list of view over view"});
}

TEST(Contract, AnotherVersionOfATypeOrAMissingOutput) {
  NodeInfo old = node<marrow::View, marrow::EdgeMap>("view", "edges");
  ++old.inputs[0].type.version;
  EXPECT_EQ(
      faults(old),
      Faults{"input 'view': the kind 'edges' has it as view, not another version of that type; build both again"});
  EXPECT_EQ(faults(node<marrow::View, marrow::EdgeMap>("view", "map")),
            Faults{"output 'edges' is missing: every node of the kind 'edges' has it"});
}

TEST(Contract, FurtherPortsAreAllowed) {
  NodeInfo info = node<marrow::View, marrow::EdgeMap>("view", "edges");
  info.inputs.push_back({"mask", "", TypeInfo::of<marrow::Image>(), false, ""});
  info.outputs.push_back({"strength", "", TypeInfo::of<marrow::Image>(), false, ""});
  EXPECT_EQ(faults(info), Faults{});
}

TEST(Contract, TraitsAreThoseOfTheKind) {
  NodeInfo info = node<marrow::View, marrow::EdgeMap>("view", "edges");
  info.traits = {"thin"};
  EXPECT_EQ(faults(info), Faults{});
  info.traits = {"thick"};
  EXPECT_EQ(faults(info), Faults{"trait 'thick': the kind 'edges' has none of that name; did you mean 'thin'?"});
}

TEST(Contract, OnlySomeKindsSeeTheTruthAndWithoutAKindPortsAreFree) {
  const NodeInfo info = node<marrow::Truth, marrow::EdgeMap>("truth", "edges");
  const Faults refused{"input 'truth': only nodes of a kind that may see the truth are given it"};
  marrow::KindInfo kind = edges_kind();
  EXPECT_EQ(contract_faults(info, &kind), refused);
  EXPECT_EQ(contract_faults(info, nullptr), refused) << "no library brings the kind";
  kind.sees_truth = true;
  EXPECT_EQ(contract_faults(info, &kind), Faults{});
  EXPECT_EQ(contract_faults(node<marrow::Volume, marrow::Volume>("a", "b"), nullptr), Faults{});
}

}  // namespace manifest_test
