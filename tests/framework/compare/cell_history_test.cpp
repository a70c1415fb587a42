// SPDX-License-Identifier: Apache-2.0
// What counts as a cell's success, what makes a node's history, and what is drawn from a seed.
#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <set>

#include "marrow/base/number_text.hpp"
#include "marrow/compare/cell.hpp"
#include "marrow/compare/draw.hpp"

namespace cell_history_test {

using namespace marrow::compare;

MetricChoice metric(MetricChoice::Better better, std::optional<double> limit) { return {"a.b", "", better, limit}; }

TEST(CellRow, IsASuccessWithinEveryLimit) {
  Experiment experiment;
  experiment.metrics = {metric(MetricChoice::Better::lower, 2.0), metric(MetricChoice::Better::higher, 0.5),
                        metric(MetricChoice::Better::lower, std::nullopt)};
  CellRow row;
  const auto success = [&](std::optional<double> a, std::optional<double> b, std::optional<double> c) {
    row.values = {a, b, c};
    return row.is_success(experiment);
  };
  EXPECT_TRUE(success(1.9, 0.6, 100));
  EXPECT_TRUE(success(-1, 0.6, std::nullopt)) << "a figure without a limit may be missing";
  EXPECT_FALSE(success(2, 0.6, 0)) << "at the limit";
  EXPECT_FALSE(success(1, 0.5, 0)) << "at the limit";
  EXPECT_FALSE(success(3, 0.6, 0));
  EXPECT_FALSE(success(1, 0.4, 0));
  EXPECT_FALSE(success(std::nullopt, 0.6, 0));
  row.failed = "it failed";
  EXPECT_FALSE(success(1, 0.6, 0));
}

TEST(Histories, EachPartThatMayChangeAResultCounts) {
  marrow::Pipeline pipeline;
  pipeline.nodes.resize(3);
  for (auto& node : pipeline.nodes) {
    node.info.name = "kind.one";
    node.info.options.resize(1);
    node.info.options[0].type = marrow::OptionType::number;
    node.options = {1.0};
    node.info.inputs.resize(2);
    node.info.inputs[0].name = "a";
    node.info.inputs[1].name = "b";
  }
  const auto reference = [](int node, int output) {
    marrow::Reference one;
    one.node = node;
    one.output = output;
    return one;
  };
  pipeline.nodes[2].wires = {{0, {reference(0, 0)}, false}, {1, {reference(1, 0)}, false}};
  const std::vector<marrow::Digest> before = histories(pipeline, "case");
  EXPECT_EQ(before[0], before[1]) << "equal nodes of equal histories";
  EXPECT_NE(before[0], before[2]);
  EXPECT_EQ(histories(pipeline, "other"), before) << "no node names a path";
  std::set<marrow::Digest> seen{before[2]};
  const auto is_new = [&](const char* what, auto change) {
    marrow::Pipeline changed = pipeline;
    change(changed);
    EXPECT_TRUE(seen.insert(histories(changed, "case")[2]).second) << what;
  };
  is_new("the node", [](auto& p) { p.nodes[2].info.name = "kind.two"; });
  is_new("an option", [](auto& p) { p.nodes[2].options[0] = 2.0; });
  is_new("a node before it", [](auto& p) { p.nodes[0].options[0] = 2.0; });
  is_new("another node before it", [](auto& p) { p.nodes[1].options[0] = 2.0; });
  is_new("an output", [](auto& p) { p.nodes[2].wires[0].sources[0].output = 1; });
  is_new("an item", [](auto& p) { p.nodes[2].wires[0].sources[0].items = {"distal"}; });
  is_new("a port", [](auto& p) { p.nodes[2].wires[1].port = 0; });
  is_new("a wire", [](auto& p) { p.nodes[2].wires.pop_back(); });
  is_new("chance", [](auto& p) { p.nodes[1].info.random = true; });
  for (const auto type : {marrow::OptionType::path, marrow::OptionType::paths}) {
    marrow::Pipeline reads = pipeline;
    reads.nodes[0].info.options[0].type = type;
    EXPECT_NE(histories(reads, "case")[2], histories(reads, "other")[2]) << "a path names the case's data";
    EXPECT_EQ(histories(reads, "case")[1], histories(reads, "other")[1]);
  }
}

TEST(Dependences, StartsDifferOnlyWhereTheyAreDrawn) {
  marrow::Pipeline pipeline;
  pipeline.nodes.resize(3);
  pipeline.nodes[0].id = "start", pipeline.nodes[1].id = "pose", pipeline.nodes[2].id = "other";
  marrow::Reference start;
  start.node = 0;
  pipeline.nodes[1].wires = {{0, {start}, false}};
  Experiment experiment;
  const auto on_start = [&] {
    std::vector<bool> result;
    for (const Dependence& one : dependences(pipeline, experiment)) result.push_back(one.on_start);
    return result;
  };
  const std::vector<bool> none{false, false, false}, two{true, true, false};
  EXPECT_EQ(on_start(), none) << "no protocol";
  experiment.protocol.emplace();
  experiment.protocol->node = "start";
  experiment.protocol->rotation_deg = experiment.protocol->translation_mm = experiment.protocol->distance_mm = 0;
  EXPECT_EQ(on_start(), none) << "all starts are the same";
  for (double StartProtocol::*size :
       {&StartProtocol::rotation_deg, &StartProtocol::translation_mm, &StartProtocol::distance_mm}) {
    (*experiment.protocol).*size = 1;
    EXPECT_EQ(on_start(), two);
    (*experiment.protocol).*size = 0;
  }
}

/// SplitMix64; scipy_test.py has it too.
struct SplitMix {
  std::uint64_t state;
  double uniform() {
    state += 0x9E3779B97F4A7C15u;
    std::uint64_t bits = (state ^ (state >> 30)) * 0xBF58476D1CE4E5B9u;
    bits = (bits ^ (bits >> 27)) * 0x94D049BB133111EBu;
    return double((bits ^ (bits >> 31)) >> 11) / 9007199254740992.0;
  }
};

TEST(Draw, StartsAreTheSameOnAnyMachine) {
  StartProtocol protocol;
  protocol.count = 5;
  protocol.seed = 11;
  protocol.rotation_deg = 4;
  protocol.translation_mm = 7;
  protocol.distance_mm = 30;
  const std::vector<Start> starts = draw_starts(protocol);
  ASSERT_EQ(starts.size(), 5u);
  SplitMix random{11};
  for (std::size_t i = 0; i < 5; ++i) {
    EXPECT_EQ(starts[i].name, std::to_string(i));
    for (const auto& [vector, most] : {std::pair(starts[i].rotation_deg, 4.0), {starts[i].translation_mm, 7.0}}) {
      const double z = 2 * random.uniform() - 1, angle = 2 * std::numbers::pi * random.uniform(),
                   length = most * random.uniform();
      EXPECT_NEAR(vector[0], length * std::sqrt(1 - z * z) * std::cos(angle), 1e-12);
      EXPECT_NEAR(vector[1], length * std::sqrt(1 - z * z) * std::sin(angle), 1e-12);
      EXPECT_NEAR(vector[2], length * z, 1e-12);
    }
    EXPECT_NEAR(starts[i].distance_mm, 30 * random.uniform(), 1e-12);
  }
  protocol.count = 2;
  EXPECT_EQ(draw_starts(protocol)[1].rotation_deg, starts[1].rotation_deg)
      << "the first starts do not depend on the number of starts";
  protocol.distance_mm = 0;
  EXPECT_EQ(draw_starts(protocol)[1].distance_mm, 0);
}

TEST(Draw, InputsAreUniformInTheirRanges) {
  const auto values = draw_inputs({{"x", {-2, 2}, {}}, {"y", {5, 5}, {}}, {"z", {100, 101}, {}}}, 3);
  SplitMix random{3};
  ASSERT_EQ(values.size(), 3u);
  EXPECT_EQ(values[0].name + values[1].name + values[2].name, "xyz");
  EXPECT_NEAR(std::stod(values[0].value), -2 + 4 * random.uniform(), 1e-5);
  random.uniform();
  EXPECT_EQ(values[1].value, "5");
  EXPECT_NEAR(std::stod(values[2].value), 100 + random.uniform(), 1e-3);
  EXPECT_EQ(marrow::short_number(0.1 + 0.2, 6), "0.3");
}

}  // namespace cell_history_test
