// SPDX-License-Identifier: Apache-2.0
// Nodes against the contract of their kind.
#include "marrow/runtime/plugins/contract.hpp"

#include <gtest/gtest.h>

#include "marrow/plugin.hpp"

namespace contract_test {

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

TEST(Contract, WhatTheKindSays) {
  EXPECT_EQ(faults(node<marrow::View, marrow::EdgeMap>("view", "edges")), Faults{});
  EXPECT_EQ(faults(node<marrow::View, marrow::Picture>("view", "edges")), Faults{}) << "the other of its two types";
}

TEST(Contract, OtherTypes) {
  EXPECT_EQ(faults(node<marrow::Volume, marrow::EdgeMap>("view", "edges")),
            Faults{"input 'view': the kind 'edges' has it as view, not volume"});
  EXPECT_EQ(faults(node<marrow::View, marrow::Volume>("view", "edges")),
            Faults{"output 'edges': the kind 'edges' has it as edge_map or picture, not volume"});
  NodeInfo list = node<marrow::View, marrow::EdgeMap>("view", "edges");
  list.inputs[0].axis = "view";
  EXPECT_EQ(faults(list), Faults{"input 'view': the kind 'edges' has it as view, not list of view over view"});
}

TEST(Contract, AnotherVersionOfAType) {
  NodeInfo old = node<marrow::View, marrow::EdgeMap>("view", "edges");
  ++old.inputs[0].type.version;
  EXPECT_EQ(
      faults(old),
      Faults{"input 'view': the kind 'edges' has it as view, not another version of that type; build both again"});
}

TEST(Contract, AMissingOutput) {
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

TEST(Contract, OnlySomeKindsSeeTheTruth) {
  const NodeInfo info = node<marrow::Truth, marrow::EdgeMap>("truth", "edges");
  const Faults refused{"input 'truth': only nodes of a kind that may see the truth are given it"};
  marrow::KindInfo kind = edges_kind();
  EXPECT_EQ(contract_faults(info, &kind), refused);
  EXPECT_EQ(contract_faults(info, nullptr), refused) << "no library brings the kind";
  kind.sees_truth = true;
  EXPECT_EQ(contract_faults(info, &kind), Faults{});
}

TEST(Contract, WithoutAKindPortsAreFree) {
  EXPECT_EQ(contract_faults(node<marrow::Volume, marrow::Volume>("a", "b"), nullptr), Faults{});
}

}  // namespace contract_test
