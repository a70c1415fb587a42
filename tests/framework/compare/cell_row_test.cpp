// SPDX-License-Identifier: Apache-2.0
// The row of a cell as text: a text that marrow did not write, or that was damaged later, is refused.
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "marrow/base/error.hpp"
#include "marrow/base/hash.hpp"
#include "marrow/compare/cell.hpp"
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

std::string fault_of(const json& row) {
  try {
    marrow::compare::row_from_json(written(row), experiment());
  } catch (const marrow::Error& error) {
    return error.what();
  }
  return "none";
}

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
}

TEST(CellRowText, SaysNotWhichCellItIsOf) {
  json forged = json::parse(to_json(good_row()));
  for (const char* part : {"id", "variant", "case", "start"}) forged[part] = "../../elsewhere";
  CellRow row = marrow::compare::row_from_json(written(forged), experiment());
  EXPECT_EQ(row.id + row.variant + row.case_name + row.start, "");
  marrow::compare::name_row(row, experiment(), {1, 0, 0});
  EXPECT_EQ(row.id, "two/a/0");
  EXPECT_EQ(row.variant + " " + row.case_name + " " + row.start, "two a 0");
}

TEST(CellRowText, ForgedOrDamaged) {
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
  EXPECT_EQ(fault_of(good), "none");
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
}

TEST(CellRowText, NoJson) {
  for (const std::string& text : {std::string(), std::string("good"), std::string("[]"), std::string("7"),
                                  std::string(100000, '['), to_json(good_row()).substr(0, 60)})
    EXPECT_THROW(marrow::compare::row_from_json(text, experiment()), marrow::Error) << text.substr(0, 80);
  std::string endless = to_json(good_row());
  endless.replace(endless.find("1.5"), 3, "1e999");
  EXPECT_THROW(marrow::compare::row_from_json(endless, experiment()), marrow::Error);
}

}  // namespace cell_row_test
