// SPDX-License-Identifier: Apache-2.0
#include <climits>
#include <cmath>

#include "marrow/compare/cell.hpp"
#include "runtime/json_text.hpp"

namespace marrow::compare {
namespace {

using nlohmann::json;

json of(const std::optional<double>& value) { return value ? json(*value) : json(); }

/// A number, or nothing for null. Throws Error for anything else, and for a number that is not finite.
std::optional<double> number(const json& j, const std::string& what) {
  if (j.is_null()) return std::nullopt;
  if (!j.is_number() || !std::isfinite(j.get<double>())) throw Error(what + " is no number");
  return j.get<double>();
}

int count(const json& j, const std::string& what) { return int(integer_of(j, 0, INT_MAX, what)); }

const json& list_of(const json& row, const char* key, std::size_t size) {
  const json& list = row.at(key);
  if (!list.is_array() || list.size() != size)
    throw Error(std::string("'") + key + "' must be a list of " + std::to_string(size));
  return list;
}

void read_verdict(const json& j, CellRow& row) {
  const std::string name = j.at("verdict");
  row.verdict = judgement_named(name);
  if (!row.verdict || !row.failed.empty()) throw Error("'verdict' is no judgement, or of a cell that failed");
  row.failure_probability = number(j.at("failure_probability"), "'failure_probability'");
  if (row.failure_probability && !(*row.failure_probability >= 0 && *row.failure_probability <= 1))
    throw Error("'failure_probability' is not from 0 to 1");
}

}  // namespace

bool CellRow::is_success(const Experiment& experiment) const {
  if (!failed.empty()) return false;
  for (std::size_t i = 0; i < experiment.metrics.size() && i < values.size(); ++i)
    if (const MetricChoice& metric = experiment.metrics[i]; metric.limit)
      if (!values[i] || !(metric.higher_is_better() ? *values[i] > *metric.limit : *values[i] < *metric.limit))
        return false;
  return true;
}

std::string to_json(const CellRow& row) {
  json j = {{"id", row.id},
            {"variant", row.variant},
            {"case", row.case_name},
            {"start", row.start},
            {"status", row.failed.empty() ? "done" : "failed"},
            {"tries", row.tries},
            {"values", json::array()},
            {"units", row.units},
            {"initial_error", of(row.initial_error)},
            {"seconds", of(row.seconds)},
            {"evaluations", row.evaluations},
            {"nodes", json::object()},
            {"key", row.key}};
  if (!row.failed.empty()) j["reason"] = row.failed;
  if (!row.absent.empty()) j["absent"] = row.absent;
  if (row.verdict) j["verdict"] = name_of(*row.verdict);
  if (row.verdict) j["failure_probability"] = of(row.failure_probability);
  for (const auto& value : row.values) j["values"].push_back(of(value));
  for (const auto& [name, calls] : row.nodes)
    j["nodes"][name] = {{"made", calls.made}, {"cached", calls.cached}, {"seconds", calls.seconds}};
  return j.dump(-1, ' ', false, json::error_handler_t::replace);
}

CellRow row_from_json(const std::string& text, const Experiment& experiment) {
  try {
    const json j = parse_json(text, "a cell's row");
    const std::size_t metrics = experiment.metrics.size();
    CellRow row;
    if (j.contains("reason")) row.failed = j.at("reason");
    if (j.contains("absent")) row.absent = j.at("absent");
    if (row.failed.empty() != (j.at("status") == "done")) throw Error("'status' and 'reason' do not agree");
    row.tries = count(j.at("tries"), "'tries'");
    for (const json& value : list_of(j, "values", metrics)) {
      row.values.push_back(number(value, "an item of 'values'"));
      if (row.values.back() ? !row.failed.empty() : row.failed.empty() && row.absent.empty())
        throw Error("a cell that is done has all values, one that failed has none");
    }
    for (const json& unit : list_of(j, "units", metrics)) row.units.push_back(unit);
    row.initial_error = number(j.at("initial_error"), "'initial_error'");
    const bool is_as_wanted = row.initial_error.has_value() != experiment.initial_error.empty();
    if (row.failed.empty() && !is_as_wanted && (row.initial_error || row.absent.empty()))
      throw Error("'initial_error' is there where the experiment has none, or is not there");
    row.seconds = number(j.at("seconds"), "'seconds'");
    row.evaluations = count(j.at("evaluations"), "'evaluations'");
    for (const auto& [name, calls] : j.at("nodes").items())
      row.nodes[name] = {count(calls.at("made"), "'made'"), count(calls.at("cached"), "'cached'"),
                         number(calls.at("seconds"), "'seconds'").value_or(0)};
    if (j.contains("verdict")) read_verdict(j, row);
    row.key = j.at("key");
    return row;
  } catch (const std::exception& error) {
    throw Error(std::string("not a cell's row: ") + error.what());
  }
}

void name_row(CellRow& row, const Experiment& experiment, const CellIndex& cell) {
  row.id = cell_id(experiment, cell);
  row.variant = experiment.variants[cell.variant].name;
  row.case_name = experiment.cases[cell.case_index].name;
  row.start = experiment.starts[cell.start].name;
}

CellRow failed_row(const Experiment& experiment, const CellIndex& cell, const std::string& reason, int tries) {
  CellRow row;
  name_row(row, experiment, cell);
  row.failed = reason;
  row.tries = tries;
  row.values.resize(experiment.metrics.size());
  row.units.resize(experiment.metrics.size());
  return row;
}

}  // namespace marrow::compare
