// SPDX-License-Identifier: Apache-2.0
// The row of a cell as text: a text that marrow did not write, or that was damaged later, is refused.

#include <cmath>
#include <nlohmann/json.hpp>
#include <numbers>

#include "marrow/base/number_text.hpp"
#include "marrow/compare/cell.hpp"
#include "marrow/compare/draw.hpp"
#include "tests/harness/message_of.hpp"

namespace cell_row_test {

using marrow::compare::CellRow;
using nlohmann::json;

marrow::compare::Experiment experiment() {
  marrow::compare::Experiment e;
  for (const char* name : {"one", "two"}) e.variants.push_back({name, {}, {}});
  e.cases.push_back({"a", {}, false, 1});
  e.starts.push_back({"0", {}, {}});
  for (const char* path : {"errors.mtre_mm", "errors.axial_deg"}) {
    e.metrics.emplace_back();
    e.metrics.back().path = path;
  }
  e.initial_error = "errors.start_mm";
  return e;
}

CellRow good_row() {
  CellRow row;
  marrow::compare::name_row(row, experiment(), {1, 0, 0});
  row.values = {1.5, -0.25};
  row.units = {"mm", "deg"};
  row.initial_error = 3.5;
  row.initial_error_unit = "mm";
  row.seconds = 0.125;
  row.evaluations = 70;
  row.nodes["edges"] = {1, 2, 0.5};
  row.key = "0123456789abcdef0123456789abcdef";
  return row;
}

/// The row as a forger who knows the digest would write it: XXH3 of the line without the digest.
std::string written(json row) {
  row.erase("digest");
  const std::string line = row.dump();
  row["digest"] = marrow::hash_of_bytes(line.data(), line.size()).hex();
  return row.dump();
}

std::string fault_of(const json& row) { return MESSAGE_OF(marrow::compare::row_from_json(written(row), experiment())); }

TEST(CellRowText, ComesBackAsItWas) {
  CellRow row = marrow::compare::row_from_json(to_json(good_row()), experiment());
  marrow::compare::name_row(row, experiment(), {1, 0, 0});
  EXPECT_EQ(to_json(row), to_json(good_row()));
  CellRow failed = marrow::compare::failed_row(experiment(), {0, 0, 0}, "it broke", 2);
  EXPECT_EQ(marrow::compare::row_from_json(to_json(failed), experiment()).failed, "it broke");
}

TEST(CellRowText, AFigureMayBeAbsentForAReason) {
  CellRow row = good_row();
  row.values[1].reset();
  row.initial_error.reset();
  row.absent = "'errors.axial_deg' is not there because node 'x' failed";
  const CellRow again = marrow::compare::row_from_json(to_json(row), experiment());
  EXPECT_EQ(again.absent, row.absent);
  EXPECT_EQ(again.values, row.values);
  EXPECT_TRUE(again.failed.empty());
  EXPECT_FALSE(again.initial_error);
  json without = json::parse(to_json(row));
  without.erase("absent");
  EXPECT_EQ(fault_of(without), "not a cell's row: a cell that is done has all values, one that failed has none");
}

TEST(CellRowText, MayHaveAVerdict) {
  CellRow row = good_row();
  row.verdict = marrow::Judgement::doubtful;
  EXPECT_EQ(marrow::compare::row_from_json(to_json(row), experiment()).verdict, row.verdict);
  EXPECT_FALSE(marrow::compare::row_from_json(to_json(row), experiment()).failure_probability);
  row.failure_probability = 0.25;
  EXPECT_EQ(marrow::compare::row_from_json(to_json(row), experiment()).failure_probability, 0.25);
  json other = json::parse(to_json(row));
  other["verdict"] = "splendid";
  EXPECT_EQ(fault_of(other), "not a cell's row: 'verdict' is no judgement, or of a cell that failed");
  other = json::parse(to_json(row));
  other["failure_probability"] = 1.5;
  EXPECT_EQ(fault_of(other), "not a cell's row: 'failure_probability' is not from 0 to 1");
  other = json::parse(to_json(marrow::compare::failed_row(experiment(), {0, 0, 0}, "it broke", 2)));
  other["verdict"] = "trusted";
  EXPECT_EQ(fault_of(other), "not a cell's row: 'verdict' is no judgement, or of a cell that failed");
}

TEST(CellRowText, HasTheFiguresOfItsVerdicts) {
  CellRow row = good_row();
  row.verdict = marrow::Judgement::trusted;
  row.verdict_figures = {{"verdict.distal", {{"doubt", 0.1}, {"unknown", std::nullopt}}}, {"verdict.proximal", {}}};
  const CellRow again = marrow::compare::row_from_json(to_json(row), experiment());
  EXPECT_EQ(again.verdict_figures, row.verdict_figures);
  json other = json::parse(to_json(row));
  other["verdict_figures"]["verdict.distal"]["doubt"] = "much";
  EXPECT_EQ(fault_of(other), "not a cell's row: 'doubt' of 'verdict_figures' is no number");
}

TEST(CellRowText, ChangedByHandIsNotBelieved) {
  const std::string text = to_json(good_row());
  EXPECT_EQ(marrow::compare::fault_of_written_row(text), "");
  EXPECT_EQ(marrow::compare::fault_of_written_row(json::parse(text).dump(2)), "");  // other blanks change nothing
  const std::string changed = "it is not what its digest is of: it was changed or damaged";
  for (const auto& [what, by] : {std::pair("1.5", "1.4"), {R"("tries":1)", R"("tries":2)"}, {R"("deg")", R"("mm")"}}) {
    std::string edited = text;
    edited.replace(edited.find(what), std::string(what).size(), by);
    EXPECT_EQ(marrow::compare::fault_of_written_row(edited), changed) << edited;
    EXPECT_THROW(marrow::compare::row_from_json(edited, experiment()), marrow::Error);
  }
  json without = json::parse(text);
  without["more"] = 1;
  EXPECT_EQ(marrow::compare::fault_of_written_row(without.dump()), changed);
  without.erase("digest");
  EXPECT_EQ(marrow::compare::fault_of_written_row(without.dump()), "it has no digest of itself");
  json forged = json::parse(to_json(good_row()));
  for (const char* part : {"id", "variant", "case", "start"}) forged[part] = "../../elsewhere";
  CellRow row = marrow::compare::row_from_json(written(forged), experiment());
  EXPECT_EQ(row.id + row.variant + row.case_name + row.start, "");
  marrow::compare::name_row(row, experiment(), {1, 0, 0});
  EXPECT_EQ(row.id, "two/a/0");
  EXPECT_EQ(row.variant + " " + row.case_name + " " + row.start, "two a 0");
}

TEST(CellRowText, ForgedDamagedOrNoJson) {
  const json good = json::parse(to_json(good_row()));
  const std::vector<std::pair<json, std::string>> changes = {
      {json{{"values", json::array()}}, "'values' must be a list of 2"},
      {json{{"values", {1}}}, "'values' must be a list of 2"},
      {json{{"values", {1, 2, 3}}}, "'values' must be a list of 2"},
      {json{{"values", {1, "2"}}}, "an item of 'values' is no number"},
      {json{{"values", {1, json()}}}, "a cell that is done has all values, one that failed has none"},
      {json{{"values", 7}}, "'values' must be a list of 2"},
      {json{{"units", {"mm"}}}, "'units' must be a list of 2"},
      {json{{"units", {"mm", 3}}}, "type must be string"},
      {json{{"evaluations", -1}}, "'evaluations' is -1; expected a whole number from 0 to 2147483647"},
      {json{{"evaluations", 1e10}}, "'evaluations': expected a whole number"},
      {json{{"evaluations", 4294967297}}, "'evaluations' is 4294967297; expected"},
      {json{{"tries", "many"}}, "'tries': expected a whole number"},
      {json{{"initial_error", "far"}}, "'initial_error' is no number"},
      {json{{"initial_error", json()}}, "'initial_error' is there where the experiment has none, or is not there"},
      {json{{"status", "failed"}}, "'status' and 'reason' do not agree"},
      {json{{"reason", "it broke"}}, "'status' and 'reason' do not agree"},
      {json{{"reason", 1}}, "type must be string"},
      {json{{"nodes", {{"edges", {{"made", -3}, {"cached", 0}, {"seconds", 0}}}}}}, "'made' is -3; expected"},
      {json{{"nodes", {{"edges", {{"made", 1}}}}}}, "key 'cached' not found"},
      {json{{"nodes", {{"edges", 1}}}}, "cannot use at() with number"},
      {json{{"key", 5}}, "type must be string"},
  };
  EXPECT_EQ(fault_of(good), "");
  for (const auto& [change, fault] : changes) {
    json row = good;
    row.update(change);
    EXPECT_HAS(fault_of(row), "not a cell's row: ") << change;
    EXPECT_HAS(fault_of(row), fault) << change << fault_of(row);
  }
  for (const char* key : {"values", "units", "initial_error_unit", "tries", "nodes", "key", "status"}) {
    json row = good;
    row.erase(key);
    EXPECT_HAS(fault_of(row), "key '" + std::string(key) + "' not found");
  }
  for (const std::string& text : {std::string(), std::string("good"), std::string("[]"), std::string("7"),
                                  std::string(100000, '['), to_json(good_row()).substr(0, 60)})
    EXPECT_THROW(marrow::compare::row_from_json(text, experiment()), marrow::Error) << text.substr(0, 80);
  std::string endless = to_json(good_row());
  endless.replace(endless.find("1.5"), 3, "1e999");
  EXPECT_THROW(marrow::compare::row_from_json(endless, experiment()), marrow::Error);
}

// What counts as a cell's success, what makes a node's history, and what is drawn from a seed.

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

}  // namespace cell_row_test
